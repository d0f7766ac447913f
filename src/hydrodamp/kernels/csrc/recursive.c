/* Recursive least squares with directional forgetting.
 *
 * A row says y = kappa . phi. In units in which the prior's information is the identity and
 * that of the data S, a row first takes the share r of S in its own direction, then brings
 * its own:
 *
 *   S <- S - r S phi phi'S / (phi'S phi) + phi phi'
 *   kappa <- kappa + (I + S)^-1 phi (y - kappa . phi)
 *
 * with r = min(forgetting, 2 phi'(I + S)^-1 phi): a row must not cost much more than it
 * brings. Whatever the rows, 0 <= S <= c I with c = max(1, max |phi|^2 / forgetting); so the
 * covariance never exceeds the prior's, and no row moves kappa, measured by the prior, by
 * more than its surprise y - kappa . phi.
 */
#include "onboard.h"

static size_t entries_on(const hd_entries *entries, size_t axis)
{
    return (size_t)(entries->starts[axis + 1] - entries->starts[axis]);
}

size_t hd_absorb_work(const hd_entries *entries)
{
    size_t most = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = entries_on(entries, i);
        most = n > most ? n : most;
    }
    return most * most + 3 * most;
}

void hd_recur_start(const hd_entries *entries, const hd_estimate *estimate,
                    const hd_real *coefficients)
{
    hd_real *information = estimate->information, *witness = estimate->witness;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = entries_on(entries, i);
        for (size_t j = 0; j < n; ++j)
            estimate->coefficients[first + j] = coefficients[first + j];
        for (size_t j = 0; j < n * n; ++j)
            information[j] = 0;
        hd_witness_start(witness, n, coefficients + first, estimate->unit + first);
        estimate->noise[i] = estimate->rows[i] = 0;
        information += n * n;
        witness += hd_witness_size(n);
    }
}

static hd_real dot(const hd_real *a, const hd_real *b, size_t n)
{
    hd_real sum = 0;

    for (size_t j = 0; j < n; ++j)
        sum += a[j] * b[j];
    return sum;
}

/* seen = S phi, gain = (I + S)^-1 phi; then forget, and return the share forgotten over
 * phi'S phi. gain becomes that of the information that is left. */
static hd_real forget(const hd_real *restrict information, const hd_real *restrict phi, size_t n,
                      hd_real forgetting, hd_real *restrict seen, hd_real *restrict gain,
                      hd_real *restrict matrix)
{
    for (size_t j = 0; j < n; ++j) {
        seen[j] = 0;
        gain[j] = phi[j];
    }
    for (size_t j = 0; j < n; ++j) { /* S is symmetric: its rows are its columns */
        for (size_t c = 0; c < n; ++c)
            seen[c] += phi[j] * information[n * j + c];
        for (size_t c = j; c < n; ++c)
            matrix[n * j + c] = information[n * j + c] + (hd_real)(j == c);
    }
    hd_cholesky(matrix, n, gain);
    const hd_real along = dot(phi, seen, n), news = dot(phi, gain, n);
    if (!(along > 0))
        return 0;
    const hd_real crossed = dot(seen, gain, n);
    const hd_real share = 2 * news < forgetting ? 2 * news : forgetting;
    const hd_real reach = share * crossed / (along - share * (along - crossed));
    for (size_t j = 0; j < n; ++j)
        gain[j] += reach * (phi[j] - gain[j]);
    return share / along;
}

/* The running variance of what rows leave over before they are taken in, each in its due
 * share; returns its weight. One that grows as the square of the count forgets a bad start. */
static hd_real watch(hd_real surprise, hd_real news, hd_real forgetting, hd_real *noise,
                     hd_real *rows)
{
    const hd_real part = 3 / (*rows + 3), weight = part > forgetting ? part : forgetting;

    *rows += 1;
    *noise += weight * (surprise * surprise / (1 + news) - *noise);
    return weight;
}

static void absorb(const hd_estimate *estimate, size_t axis, size_t first, size_t n,
                   const int32_t *rows, const hd_real *row, hd_real target,
                   hd_real *restrict information, hd_real *witness, hd_real *work)
{
    const hd_real *unit = estimate->unit + first;
    hd_real *kappa = estimate->coefficients + first;
    hd_real *restrict phi = work, *restrict seen = phi + n, *restrict gain = seen + n;
    hd_real surprise = target;

    for (size_t j = 0; j < n; ++j) {
        phi[j] = unit[j] * row[rows[j]];
        surprise -= kappa[j] * row[rows[j]];
    }
    const hd_real lost = forget(information, phi, n, estimate->forgetting, seen, gain, gain + n);
    const hd_real news = dot(phi, gain, n), along = dot(phi, seen, n);
    if (along > 0)
        hd_witness_forget(witness, n, phi, seen, (1 - hd_sqrt(1 - lost * along)) / along, gain + n);
    for (size_t j = 0; j < n; ++j) {
        kappa[j] += unit[j] * gain[j] * (surprise / (1 + news));
        for (size_t c = 0; c < n; ++c)
            information[n * j + c] += phi[j] * phi[c] - lost * (seen[j] * seen[c]);
    }
    const hd_real weight = watch(surprise, news, estimate->forgetting, estimate->noise + axis,
                                 estimate->rows + axis);
    hd_witness_row(witness, n, phi, target, surprise / hd_sqrt(1 + news), weight, gain);
}

void hd_absorb(const hd_entries *entries, const hd_estimate *estimate, size_t n_terms,
               const hd_real *row, hd_real *work)
{
    hd_real *information = estimate->information, *witness = estimate->witness;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = entries_on(entries, i);
        if (n)
            absorb(estimate, i, first, n, entries->rows + first, row, row[n_terms + i],
                   information, witness, work);
        information += n * n;
        witness += hd_witness_size(n);
    }
}
