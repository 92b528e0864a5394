/* Instructions of a call: on a Cortex-M under `qemu -icount shift=0`, where one takes a nanosecond, by SysTick at
 * 25 MHz, so in steps of 40; elsewhere none. */
#ifndef CLOCK_H
#define CLOCK_H

static unsigned long clock_sum, clock_most, clock_at;

#ifdef __arm__
#define SYST_CSR (*(volatile unsigned long *)0xE000E010UL)
#define SYST_RVR (*(volatile unsigned long *)0xE000E014UL)
#define SYST_CVR (*(volatile unsigned long *)0xE000E018UL)
static void clock_start(void)
{
    SYST_RVR = 0xFFFFFFUL;
    SYST_CVR = 0UL;
    SYST_CSR = 5UL;
}
static void clock_begin(void) { clock_at = SYST_CVR; }
static void clock_end(void)
{
    unsigned long used = ((clock_at - SYST_CVR) & 0xFFFFFFUL) * 40UL;
    clock_sum += used;
    clock_most = (used > clock_most) ? used : clock_most;
}
#else
static void clock_start(void) { clock_at = 0UL; }
static void clock_begin(void) { clock_at = 0UL; }
static void clock_end(void) { clock_most = clock_at; }
#endif

#endif
