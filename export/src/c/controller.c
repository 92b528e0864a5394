/* --- the controller ------------------------------------------------------------------------------------------------ */

static struct {
@fields@
} control;

void @name@_control_reset(void)
{
@resets@
}

@name@_real @name@_control(const @name@_reference *now, const @name@_reference *ahead, @name@_real measured,
                           @name@_real current)
{
@body@
    return @result@;
}
