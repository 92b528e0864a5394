/* The beginning of a Cortex-M4F: its vector table, and the floating-point unit switched on before newlib starts. */
#include <stdint.h>

extern void _start(void);
extern uint32_t stack_top;

void Reset_Handler(void);
static void hang(void)
{
    for (;;) {
    }
}

__attribute__((naked)) void Reset_Handler(void)
{
    __asm volatile("ldr r0, =0xE000ED88\n"
                   "ldr r1, [r0]\n"
                   "orr r1, r1, #0xF00000\n"
                   "str r1, [r0]\n"
                   "dsb\n"
                   "isb\n"
                   "b _start\n");
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top, (void *)Reset_Handler, (void *)hang, (void *)hang, (void *)hang, (void *)hang, (void *)hang, 0, 0, 0, 0,
    (void *)hang, 0, 0, (void *)hang, (void *)hang};
