/*
 * The controller: @structure@.
 *
 * Call @name@_control once every @NAME@_SAMPLE_TIME s. Its command, @unit@, is meant to act @NAME@_DELAY s after the
 * sample.
@remarks@ */
#define @NAME@_SAMPLE_TIME @every@
#define @NAME@_DELAY @delay@
/* How far ahead of the sample `ahead` is looked up, s. */
#define @NAME@_LEAD @lead@

@arrays@/* Where @whose@ should be, and how that changes. */
typedef struct {
@fields@
} @name@_reference;

/* Forgets all samples. Call this before anything else. */
void @name@_control_reset(void);

/*
 * The command, @unit@, that follows from the reference at the sample and ahead of it, the measured position (m along the
 * belt) and the measured motor current (A).
 */
@name@_real @name@_control(const @name@_reference *now, const @name@_reference *ahead, @name@_real measured,
                           @name@_real current);
