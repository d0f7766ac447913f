/* Recursive least squares with directional forgetting.
 *
 * A row says y = kappa . phi. In units in which the prior's information is the identity and
 * that of the data S, a row first removes the share r of S along phi, then adds
 * its own information:
 *
 *   S <- S - r S phi phi'S / (phi'S phi) + phi phi'
 *   kappa <- kappa + (I + S)^-1 phi (y - kappa . phi)
 *
 * with r = min(forgetting, 2 phi'(I + S)^-1 phi): a row must not remove much more information
 * than it adds. Whatever the rows, 0 <= S <= c I with c = max(1, max |phi|^2 / forgetting); so the
 * covariance never exceeds the prior's, and no row moves kappa, measured by the prior, by
 * more than its innovation y - kappa . phi.
 */
#include "onboard.h"

static size_t n_entries(const hd_entries *entries, size_t axis)
{
    return (size_t)(entries->starts[axis + 1] - entries->starts[axis]);
}

size_t hd_absorb_work(const hd_entries *entries)
{
    size_t largest = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = n_entries(entries, i);
        largest = n > largest ? n : largest;
    }
    return largest * largest + 3 * largest;
}

void hd_recur_start(const hd_entries *entries, const hd_estimate *estimate,
                    const hd_real *coefficients)
{
    hd_real *information = estimate->information, *iv = estimate->iv;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = n_entries(entries, i);
        for (size_t j = 0; j < n; ++j)
            estimate->coefficients[first + j] = coefficients[first + j];
        for (size_t j = 0; j < n * n; ++j)
            information[j] = 0;
        hd_iv_start(iv, n, coefficients + first, estimate->unit + first);
        estimate->noise[i] = estimate->rows[i] = 0;
        information += n * n;
        iv += hd_iv_size(n);
    }
}

static hd_real dot(const hd_real *a, const hd_real *b, size_t n)
{
    hd_real sum = 0;

    for (size_t j = 0; j < n; ++j)
        sum += a[j] * b[j];
    return sum;
}

/* s_phi = S phi, gain = (I + S)^-1 phi; then forget: return r / (phi'S phi), the factor of the
 * rank-one downdate, and update gain to that of the remaining information. */
static hd_real forget(const hd_real *restrict information, const hd_real *restrict phi, size_t n,
                      hd_real forgetting, hd_real *restrict s_phi, hd_real *restrict gain,
                      hd_real *restrict matrix)
{
    for (size_t j = 0; j < n; ++j) {
        s_phi[j] = 0;
        gain[j] = phi[j];
    }
    for (size_t j = 0; j < n; ++j) { /* S is symmetric: its rows are its columns */
        for (size_t c = 0; c < n; ++c)
            s_phi[c] += phi[j] * information[n * j + c];
        for (size_t c = j; c < n; ++c)
            matrix[n * j + c] = information[n * j + c] + (hd_real)(j == c);
    }
    hd_cholesky(matrix, n, gain);
    const hd_real phi_s_phi = dot(phi, s_phi, n), leverage = dot(phi, gain, n);
    if (!(phi_s_phi > 0))
        return 0;
    const hd_real cross = dot(s_phi, gain, n);
    const hd_real share = 2 * leverage < forgetting ? 2 * leverage : forgetting;
    const hd_real correction = share * cross / (phi_s_phi - share * (phi_s_phi - cross));
    for (size_t j = 0; j < n; ++j)
        gain[j] += correction * (phi[j] - gain[j]);
    return share / phi_s_phi;
}

/* Update the running variance of the normalised innovations, and return the weight of this one.
 * Weights that grow as the square of the count forget the start quickly. */
static hd_real update_noise_variance(hd_real innovation, hd_real leverage, hd_real forgetting,
                                     hd_real *noise, hd_real *rows)
{
    const hd_real startup = 3 / (*rows + 3), weight = startup > forgetting ? startup : forgetting;

    *rows += 1;
    *noise += weight * (innovation * innovation / (1 + leverage) - *noise);
    return weight;
}

static void update_axis(const hd_estimate *estimate, size_t axis, size_t first, size_t n,
                   const int32_t *rows, const hd_real *row, hd_real target,
                   hd_real *restrict information, hd_real *iv, hd_real *work)
{
    const hd_real *unit = estimate->unit + first;
    hd_real *kappa = estimate->coefficients + first;
    hd_real *restrict phi = work, *restrict s_phi = phi + n, *restrict gain = s_phi + n;
    hd_real innovation = target;

    for (size_t j = 0; j < n; ++j) {
        phi[j] = unit[j] * row[rows[j]];
        innovation -= kappa[j] * row[rows[j]];
    }
    const hd_real downdate =
        forget(information, phi, n, estimate->forgetting, s_phi, gain, gain + n);
    const hd_real leverage = dot(phi, gain, n), phi_s_phi = dot(phi, s_phi, n);
    if (phi_s_phi > 0)
        hd_iv_forget(iv, n, phi, s_phi, (1 - hd_sqrt(1 - downdate * phi_s_phi)) / phi_s_phi,
                     gain + n);
    for (size_t j = 0; j < n; ++j) {
        kappa[j] += unit[j] * gain[j] * (innovation / (1 + leverage));
        for (size_t c = 0; c < n; ++c)
            information[n * j + c] += phi[j] * phi[c] - downdate * (s_phi[j] * s_phi[c]);
    }
    const hd_real weight = update_noise_variance(innovation, leverage, estimate->forgetting,
                                                 estimate->noise + axis, estimate->rows + axis);
    hd_iv_update(iv, n, phi, target, innovation / hd_sqrt(1 + leverage), weight, gain);
}

void hd_absorb(const hd_entries *entries, const hd_estimate *estimate, size_t n_terms,
               const hd_real *row, hd_real *work)
{
    hd_real *information = estimate->information, *iv = estimate->iv;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = n_entries(entries, i);
        if (n)
            update_axis(estimate, i, first, n, entries->rows + first, row, row[n_terms + i],
                   information, iv, work);
        information += n * n;
        iv += hd_iv_size(n);
    }
}
