/*
 * Deviations from MISRA C:2012: 15.5 (some functions return in the middle), 20.10 (## puts the ending of a number's type
 * behind it, in one macro), D4.9 (that macro looks like a function), 2.5 (a macro may be of no use to one machine), 17.8
 * (a loop's own variable is used again), 8.7 (what a program does not call). There is no recursion, no pointer
 * arithmetic beyond an index, no union, no goto, and every loop has a bound.
 */
#include "@header@"

#define R(x) (@suffix@)

@parts@
