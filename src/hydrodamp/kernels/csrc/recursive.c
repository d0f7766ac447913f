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
#include "batch.h"

size_t hd_absorb_work(const hd_entries *entries)
{
    size_t most = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = hd_entries_on(entries, i);
        most = n > most ? n : most;
    }
    return most * most + 3 * most;
}

/* The lower triangle of I + S = L D L', square-root free, over a copy. */
static void factorise(const hd_real *information, size_t n, hd_real *factor)
{
    for (size_t i = 0; i < n; ++i) {
        for (size_t j = 0; j <= i; ++j) {
            hd_real sum = information[n * i + j] + (hd_real)(i == j);
            for (size_t k = 0; k < j; ++k)
                sum -= factor[n * i + k] * factor[n * j + k] * factor[(n + 1) * k];
            factor[n * i + j] = i == j ? sum : sum / factor[(n + 1) * j];
        }
    }
}

/* L D L' x = right, in place. */
static void resolve(const hd_real *factor, size_t n, hd_real *right)
{
    for (size_t i = 0; i < n; ++i)
        for (size_t k = 0; k < i; ++k)
            right[i] -= factor[n * i + k] * right[k];
    for (size_t i = n; i-- > 0;) {
        right[i] /= factor[(n + 1) * i];
        for (size_t k = i + 1; k < n; ++k)
            right[i] -= factor[n * k + i] * right[k];
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
static hd_real forget(const hd_real *information, const hd_real *phi, size_t n,
                      hd_real forgetting, hd_real *seen, hd_real *gain, hd_real *factor)
{
    for (size_t j = 0; j < n; ++j) {
        seen[j] = dot(information + n * j, phi, n);
        gain[j] = phi[j];
    }
    factorise(information, n, factor);
    resolve(factor, n, gain);
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
 * share. A mean with weights that grow as the square of the count forgets a bad start. */
static void watch(hd_real surprise, hd_real news, hd_real forgetting, hd_real *noise,
                  hd_real *rows)
{
    const hd_real part = 3 / (*rows + 3), weight = part > forgetting ? part : forgetting;

    *rows += 1;
    *noise += weight * (surprise * surprise / (1 + news) - *noise);
}

static void absorb(const hd_estimate *estimate, size_t axis, size_t first, size_t n,
                   const int64_t *rows, const hd_real *row, hd_real target,
                   hd_real *information, hd_real *work)
{
    const hd_real *unit = estimate->unit + first;
    hd_real *kappa = estimate->coefficients + first;
    hd_real *phi = work, *seen = phi + n, *gain = seen + n;
    hd_real surprise = target;

    for (size_t j = 0; j < n; ++j) {
        phi[j] = unit[j] * row[rows[j]];
        surprise -= kappa[j] * row[rows[j]];
    }
    const hd_real lost = forget(information, phi, n, estimate->forgetting, seen, gain, gain + n);
    const hd_real news = dot(phi, gain, n);
    for (size_t j = 0; j < n; ++j) {
        kappa[j] += unit[j] * gain[j] * (surprise / (1 + news));
        for (size_t c = 0; c < n; ++c)
            information[n * j + c] += phi[j] * phi[c] - lost * (seen[j] * seen[c]);
    }
    watch(surprise, news, estimate->forgetting, estimate->noise + axis, estimate->rows + axis);
}

void hd_absorb(const hd_entries *entries, const hd_estimate *estimate, size_t n_terms,
               const hd_real *row, hd_real *work)
{
    hd_real *information = estimate->information;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = hd_entries_on(entries, i);
        if (n)
            absorb(estimate, i, first, n, entries->rows + first, row, row[n_terms + i],
                   information, work);
        information += n * n;
    }
}

size_t hd_recur_work(const hd_entries *entries, size_t n_terms, size_t n_channels)
{
    return hd_walk_work(n_terms, n_channels) + n_terms + 6 + hd_absorb_work(entries);
}

static void store(const hd_history *history, size_t place, const hd_entries *entries,
                  hd_real time, const hd_estimate *estimate)
{
    const size_t n = (size_t)entries->starts[6];

    history->time[place] = time;
    for (size_t i = 0; i < 6; ++i)
        history->error[6 * place + i] = estimate->noise[i];
    for (size_t e = 0; e < n; ++e)
        history->matrix[n * place + e] = estimate->coefficients[e];
}

void hd_recur(const hd_plant *plant, const hd_entries *entries, const hd_estimate *estimate,
              hd_real length, hd_real *block, const hd_record *record, const int64_t *segments,
              size_t n_segments, const hd_history *history, hd_real *work)
{
    hd_real *row = work + hd_walk_work(plant->n_terms, plant->n_channels);
    hd_real *rest = row + plant->n_terms + 6;
    size_t count = 0;
    hd_walk walk;

    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        const hd_sample first = hd_sample_at(record, start);
        hd_walk_from(plant, &first, &walk, work);
        for (size_t i = 0; i < hd_block_size(plant->n_terms); ++i)
            block[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            const hd_sample current = hd_sample_at(record, k);
            hd_walk_to(plant, &current, &walk);
            if (hd_block_add(plant, entries, &walk.step, length, block, row))
                hd_absorb(entries, estimate, plant->n_terms, row, rest);
            ++count;
            if (history->every && count % history->every == 0)
                store(history, count / history->every - 1, entries, current.time, estimate);
        }
    }
}
