/* What tells how far recursive least squares may be off, beside its information.
 *
 * Noise in the terms themselves pulls least squares away from the truth, the same way however
 * long it runs. An estimate whose instruments z are the terms a few rows before and after,
 *
 *   kappa' <- kappa' + (I + B)^-1 z (y - kappa' . phi),   B <- B + z phi'
 *
 * is not pulled, for noise is not correlated over so long: how far it is away says how far off
 * both may be. It forgets as the information does: that is S <- F S F' with
 * F = I - c S phi phi' / (phi'S phi), (1 - c)^2 = 1 - r, and here B <- F B F'. Correlation of
 * what rows leave over is kept beside it, by its products at lags of some rows.
 */
#include "onboard.h"

enum { APART = 3, KEPT = 2 * APART + 1, LAGS = 4 };
enum { COUNT, LEFT, PRODUCTS = LEFT + LAGS, ESTIMATE = PRODUCTS + LAGS };

size_t hd_witness_size(size_t n)
{
    return ESTIMATE + n + n * n + KEPT * (n + 1);
}

void hd_witness_start(hd_real *witness, size_t n, const hd_real *coefficients,
                      const hd_real *unit)
{
    for (size_t i = 0; i < hd_witness_size(n); ++i)
        witness[i] = 0;
    for (size_t j = 0; j < n; ++j)
        witness[ESTIMATE + j] = unit[j] > 0 ? coefficients[j] / unit[j] : 0;
}

void hd_witness_break(const hd_entries *entries, hd_real *witness)
{
    for (size_t i = 0; i < 6; ++i) {
        witness[COUNT] = 0;
        witness += hd_witness_size((size_t)(entries->starts[i + 1] - entries->starts[i]));
    }
}

/* Solve a x = b in place, a being destroyed, with the largest pivots. */
static void solve(hd_real *a, size_t n, hd_real *b)
{
    for (size_t j = 0; j < n; ++j) {
        size_t top = j;
        for (size_t i = j + 1; i < n; ++i)
            top = hd_fabs(a[n * i + j]) > hd_fabs(a[n * top + j]) ? i : top;
        hd_real *restrict pivot = a + n * j;
        for (size_t k = j; k < n && top != j; ++k) {
            const hd_real swapped = pivot[k];
            pivot[k] = a[n * top + k];
            a[n * top + k] = swapped;
        }
        const hd_real other = b[j];
        b[j] = b[top];
        b[top] = other;
        for (size_t i = j + 1; i < n; ++i) {
            hd_real *restrict lower = a + n * i;
            const hd_real factor = lower[j] / pivot[j];
            for (size_t k = j + 1; k < n; ++k)
                lower[k] -= factor * pivot[k];
            b[i] -= factor * b[j];
        }
    }
    for (size_t j = n; j-- > 0;) {
        for (size_t k = j + 1; k < n; ++k)
            b[j] -= a[n * j + k] * b[k];
        b[j] /= a[(n + 1) * j];
    }
}

void hd_witness_forget(hd_real *witness, size_t n, const hd_real *restrict phi,
                       const hd_real *restrict seen, hd_real part, hd_real *restrict work)
{
    hd_real *restrict moments = witness + ESTIMATE + n;

    for (size_t j = 0; j < n; ++j) {
        work[j] = 0;
        for (size_t c = 0; c < n; ++c)
            work[j] += moments[n * j + c] * phi[c];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c)
            moments[n * j + c] -= part * work[j] * seen[c];
    for (size_t c = 0; c < n; ++c) {
        work[c] = 0;
        for (size_t j = 0; j < n; ++j)
            work[c] += phi[j] * moments[n * j + c];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c)
            moments[n * j + c] -= part * seen[j] * work[c];
}

/* Products of what this row and those before it leave over, each a running mean. */
static void correlate(hd_real *witness, hd_real left, hd_real weight)
{
    const hd_real count = witness[COUNT];

    for (size_t lag = 0; lag < LAGS; ++lag)
        if ((hd_real)lag < count)
            witness[PRODUCTS + lag] += weight * (left * witness[LEFT + lag] - witness[PRODUCTS + lag]);
    for (size_t lag = LAGS - 1; lag > 0; --lag)
        witness[LEFT + lag] = witness[LEFT + lag - 1];
    witness[LEFT] = left;
}

void hd_witness_row(hd_real *witness, size_t n, const hd_real *phi, hd_real target, hd_real left,
                    hd_real weight, hd_real *work)
{
    hd_real *estimate = witness + ESTIMATE, *restrict moments = estimate + n;
    hd_real *restrict rows = moments + n * n, *restrict matrix = work, *restrict z = work + n * n;
    const hd_real *middle = rows + APART * (n + 1);

    correlate(witness, left, weight);
    for (size_t k = KEPT * (n + 1); k-- > n + 1;)
        rows[k] = rows[k - n - 1];
    for (size_t j = 0; j < n; ++j)
        rows[j] = phi[j];
    rows[n] = target;
    if (witness[COUNT] < KEPT)
        witness[COUNT] += 1;
    if (!(witness[COUNT] > APART))
        return;
    hd_real surprise = middle[n];
    for (size_t j = 0; j < n; ++j) {
        z[j] = rows[j] + (witness[COUNT] == KEPT ? rows[2 * APART * (n + 1) + j] : 0);
        surprise -= estimate[j] * middle[j];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c) {
            moments[n * j + c] += z[j] * middle[c];
            matrix[n * j + c] = moments[n * j + c] + (hd_real)(j == c);
        }
    solve(matrix, n, z);
    for (size_t j = 0; j < n; ++j)
        estimate[j] += z[j] * surprise;
}
