/*
 * @title@
 *
 * Written by taut @version@. C99, with nothing of the C library: no allocation, no file, no mathematical function.
 * Numbers are @real@ throughout. Everything is in SI units. All state is static: one machine, and no calls from two
 * threads or from an interrupt at once.
 *
 * To get the results of taut to the last bit the compiler must not join a product and a sum into one rounding: compile
 * with -ffp-contract=off, and never with -ffast-math.
 */
#ifndef @NAME@_H
#define @NAME@_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef @real@ @name@_real;

@parts@
#ifdef __cplusplus
}
#endif

#endif
