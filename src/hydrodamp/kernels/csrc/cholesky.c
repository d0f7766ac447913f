/* Symmetric positive-definite systems by L D L^T, square-root free. */
#include "onboard.h"

/* Column j of a = L D L^T and of L y = b. The upper triangle of a becomes D L^T row by row,
 * its diagonal the pivots' reciprocals. Constant n and j let the compiler unroll the loops. */
static inline void eliminate(hd_real *a, hd_real *b, size_t n, size_t j)
{
    const hd_real *from = a + n * j;
    const hd_real scale = 1 / from[j];

    for (size_t i = j + 1; i < n; ++i) {
        const hd_real factor = from[i] * scale;
        hd_real *to = a + n * i;
        for (size_t k = i; k < n; ++k)
            to[k] -= factor * from[k];
        b[i] -= factor * b[j];
    }
    a[(n + 1) * j] = scale;
}

/* Row j of D L^T x = y, the rows below being solved. */
static inline void substitute(const hd_real *a, hd_real *b, size_t n, size_t j)
{
    for (size_t k = n - 1; k > j; --k)
        b[j] -= a[n * j + k] * b[k];
    b[j] *= a[(n + 1) * j];
}

void hd_cholesky_six(hd_real a[36], hd_real b[6])
{
    eliminate(a, b, 6, 0);
    eliminate(a, b, 6, 1);
    eliminate(a, b, 6, 2);
    eliminate(a, b, 6, 3);
    eliminate(a, b, 6, 4);
    eliminate(a, b, 6, 5);
    substitute(a, b, 6, 5);
    substitute(a, b, 6, 4);
    substitute(a, b, 6, 3);
    substitute(a, b, 6, 2);
    substitute(a, b, 6, 1);
    substitute(a, b, 6, 0);
}

void hd_cholesky(hd_real *a, size_t n, hd_real *b)
{
    for (size_t j = 0; j < n; ++j) {
        hd_real *pivot = a + (n + 1) * j;
        if (!(*pivot > (hd_real)0.5)) /* the matrix is I + S with S >= 0: it is 1 or more */
            *pivot = 1;
        eliminate(a, b, n, j);
    }
    for (size_t j = n; j-- > 0;)
        substitute(a, b, n, j);
}

void hd_factorise(hd_real *a, size_t n)
{
    for (size_t j = 0; j < n; ++j) {
        hd_real *from = a + n * j;
        from[j] = 1 / (from[j] > (hd_real)0.5 ? from[j] : 1);
        for (size_t i = j + 1; i < n; ++i)
            for (size_t k = i; k < n; ++k)
                a[n * i + k] -= from[i] * from[j] * from[k];
    }
}

void hd_solve(const hd_real *a, size_t n, hd_real *b)
{
    for (size_t j = 0; j < n; ++j)
        for (size_t i = j + 1; i < n; ++i)
            b[i] -= a[n * j + i] * a[(n + 1) * j] * b[j];
    for (size_t j = n; j-- > 0;)
        substitute(a, b, n, j);
}
