/* A number that counts what is computed with it: products and quotients, sums and differences. C++. */
#ifndef COUNTED_H
#define COUNTED_H

struct counted {
    static unsigned long products, sums;
    BASE value;
    counted() : value(0) {}
    template <typename T> counted(T other) : value((BASE)other) {}
    explicit operator int32_t() const { return (int32_t)value; }
    counted &operator+=(counted b) { sums++; value += b.value; return *this; }
    counted &operator-=(counted b) { sums++; value -= b.value; return *this; }
    counted &operator*=(counted b) { products++; value *= b.value; return *this; }
    counted operator-() const { return counted(-value); }
    friend counted operator+(counted a, counted b) { return a += b; }
    friend counted operator-(counted a, counted b) { return a -= b; }
    friend counted operator*(counted a, counted b) { return a *= b; }
    friend counted operator/(counted a, counted b) { products++; return counted(a.value / b.value); }
    friend bool operator<(counted a, counted b) { return a.value < b.value; }
    friend bool operator>(counted a, counted b) { return a.value > b.value; }
    friend bool operator<=(counted a, counted b) { return a.value <= b.value; }
    friend bool operator>=(counted a, counted b) { return a.value >= b.value; }
};

#endif
