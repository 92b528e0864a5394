/*
 * Deviations from MISRA C:2012, as the addon of cppcheck finds them: 2.5 (a macro may be of no use to one machine), 8.7 and
 * 8.9 (what could be of a narrower scope), 9.3 (a table of zeros is written shorter), 10.3, 10.4, 10.6 and 10.8 (whole
 * numbers of several widths), 14.1 and 14.4 (flags are whole numbers), 15.5 (some functions return in the middle), 17.8 (a
 * parameter is used again). Besides: 20.10 and directive 4.9 (one macro puts the ending of a number's type behind it).
 * There is no recursion, no pointer arithmetic beyond an index, no union, no goto, and every loop has a bound.
 */
#include "@header@"

#define R(x) (@suffix@)

@parts@
