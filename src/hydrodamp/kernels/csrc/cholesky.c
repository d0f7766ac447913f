/* The one 6 x 6 symmetric positive-definite solve of every step. */
#include "onboard.h"

/* Column j of a = L D L^T, square-root free, and of L y = b. The upper triangle of a
 * becomes D L^T row by row, its diagonal the pivots' reciprocals. With j a constant
 * the compiler lays both loops out flat. */
static inline void eliminate(hd_real a[36], hd_real b[6], size_t j)
{
    const hd_real scale = 1 / a[7 * j];

    for (size_t i = j + 1; i < 6; ++i) {
        const hd_real factor = a[6 * j + i] * scale;
        for (size_t k = i; k < 6; ++k)
            a[6 * i + k] -= factor * a[6 * j + k];
        b[i] -= factor * b[j];
    }
    a[7 * j] = scale;
}

/* Row j of D L^T x = y, the rows below being solved. */
static inline void substitute(const hd_real a[36], hd_real b[6], size_t j)
{
    for (size_t k = 5; k > j; --k)
        b[j] -= a[6 * j + k] * b[k];
    b[j] *= a[7 * j];
}

void hd_cholesky_solve(hd_real a[36], hd_real b[6])
{
    eliminate(a, b, 0);
    eliminate(a, b, 1);
    eliminate(a, b, 2);
    eliminate(a, b, 3);
    eliminate(a, b, 4);
    eliminate(a, b, 5);
    substitute(a, b, 5);
    substitute(a, b, 4);
    substitute(a, b, 3);
    substitute(a, b, 2);
    substitute(a, b, 1);
    substitute(a, b, 0);
}
