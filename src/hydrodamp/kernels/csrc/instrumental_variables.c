/* Recursive instrumental variables, and lag products of the innovations, per axis.
 *
 * Noise in the regressors biases least squares, however many rows there are (errors-in-variables
 * bias). An estimate whose instruments z are the regressors three rows before and after,
 *
 *   kappa' <- kappa' + (I + B)^-1 z (y - kappa' . phi),   B <- B + z phi'
 *
 * is consistent where the noise is uncorrelated over three rows: its distance from least squares
 * estimates the bias. It forgets as the information does: that is S <- F S F' with
 * F = I - c S phi phi' / (phi'S phi), (1 - c)^2 = 1 - r, and here B <- F B F'. Running
 * means of products of innovations at lags of 1 to 4 rows estimate their autocovariance.
 */
#include "onboard.h"

enum { OFFSET = 3, N_ROWS = 2 * OFFSET + 1, LAGS = HD_IV_LAGS }; /* rows */
enum { COUNT, INNOVATIONS, PRODUCTS = HD_IV_PRODUCTS, ESTIMATE = HD_IV_ESTIMATE };

size_t hd_iv_size(size_t n)
{
    return ESTIMATE + n + n * n + N_ROWS * (n + 1);
}

void hd_iv_start(hd_real *state, size_t n, const hd_real *coefficients,
                      const hd_real *unit)
{
    for (size_t i = 0; i < hd_iv_size(n); ++i)
        state[i] = 0;
    for (size_t j = 0; j < n; ++j)
        state[ESTIMATE + j] = unit[j] > 0 ? coefficients[j] / unit[j] : 0;
}

void hd_iv_begin_segment(const hd_entries *entries, hd_real *state)
{
    for (size_t i = 0; i < 6; ++i) {
        state[COUNT] = 0;
        state += hd_iv_size((size_t)(entries->starts[i + 1] - entries->starts[i]));
    }
}

/* Solve a x = b in place by Gaussian elimination with partial pivoting; a is overwritten. */
static void solve(hd_real *a, size_t n, hd_real *b)
{
    for (size_t j = 0; j < n; ++j) {
        size_t largest = j;
        for (size_t i = j + 1; i < n; ++i)
            largest = hd_fabs(a[n * i + j]) > hd_fabs(a[n * largest + j]) ? i : largest;
        hd_real *restrict pivot = a + n * j;
        for (size_t k = j; k < n && largest != j; ++k) {
            const hd_real swapped = pivot[k];
            pivot[k] = a[n * largest + k];
            a[n * largest + k] = swapped;
        }
        const hd_real swapped_right = b[j];
        b[j] = b[largest];
        b[largest] = swapped_right;
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

void hd_iv_forget(hd_real *state, size_t n, const hd_real *restrict phi,
                       const hd_real *restrict s_phi, hd_real factor, hd_real *restrict work)
{
    hd_real *restrict moments = state + ESTIMATE + n;

    for (size_t j = 0; j < n; ++j) {
        work[j] = 0;
        for (size_t c = 0; c < n; ++c)
            work[j] += moments[n * j + c] * phi[c];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c)
            moments[n * j + c] -= factor * work[j] * s_phi[c];
    for (size_t c = 0; c < n; ++c) {
        work[c] = 0;
        for (size_t j = 0; j < n; ++j)
            work[c] += phi[j] * moments[n * j + c];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c)
            moments[n * j + c] -= factor * s_phi[j] * work[c];
}

/* Update the running mean of the product of this innovation and each of the last four. */
static void update_lag_products(hd_real *state, hd_real innovation, hd_real weight)
{
    const hd_real count = state[COUNT];

    for (size_t lag = 0; lag < LAGS; ++lag)
        if ((hd_real)lag < count)
            state[PRODUCTS + lag] +=
                weight * (innovation * state[INNOVATIONS + lag] - state[PRODUCTS + lag]);
    for (size_t lag = LAGS - 1; lag > 0; --lag)
        state[INNOVATIONS + lag] = state[INNOVATIONS + lag - 1];
    state[INNOVATIONS] = innovation;
}

void hd_iv_update(hd_real *state, size_t n, const hd_real *phi, hd_real target, hd_real innovation,
                    hd_real weight, hd_real *work)
{
    hd_real *estimate = state + ESTIMATE, *restrict moments = estimate + n;
    hd_real *restrict rows = moments + n * n, *restrict matrix = work, *restrict z = work + n * n;
    const hd_real *middle = rows + OFFSET * (n + 1);

    update_lag_products(state, innovation, weight);
    for (size_t k = N_ROWS * (n + 1); k-- > n + 1;)
        rows[k] = rows[k - n - 1];
    for (size_t j = 0; j < n; ++j)
        rows[j] = phi[j];
    rows[n] = target;
    if (state[COUNT] < N_ROWS)
        state[COUNT] += 1;
    if (!(state[COUNT] > OFFSET))
        return;
    hd_real iv_innovation = middle[n];
    for (size_t j = 0; j < n; ++j) {
        z[j] = rows[j] + (state[COUNT] == N_ROWS ? rows[2 * OFFSET * (n + 1) + j] : 0);
        iv_innovation -= estimate[j] * middle[j];
    }
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < n; ++c) {
            moments[n * j + c] += z[j] * middle[c];
            matrix[n * j + c] = moments[n * j + c] + (hd_real)(j == c);
        }
    solve(matrix, n, z);
    for (size_t j = 0; j < n; ++j)
        estimate[j] += z[j] * iv_innovation;
}
