/* The adaptive identifier made robust: a gain matrix an axis, leakage, dead zone, bounds.
 *
 * With d the mid-step error, kappa_i the coefficients of axis i and xi_i their terms, one
 * implicit midpoint step of length h solves
 *
 *   M (D_{k+1} - D_k)/h = f + K_mid xi - diag(a) d - M (nu_{k+1} - nu_k)/h
 *   (kappa_{k+1} - kappa_k)/h = -theta Gamma_i xi_i d_i - sigma (kappa_mid - rest).
 *
 * theta, between 0 and 1, is the dead zone. With |D|_M = hd_sqrt(D'MD) and e_k the excess of
 * |D_k|_M over its size, theta = (e_{k+1}^2 - e_k^2) / (|D_{k+1}|_M^2 - |D_k|_M^2): the
 * discrete gradient of V_D = e^2/2 is theta M d. So V = V_D + 1/2 sum E_i' Gamma_i^-1 E_i,
 * E = kappa - kappa_true, changes by exactly
 *
 *   -h theta (d'diag(a)d - d.eps) - h sigma sum (kappa_mid - rest)_i' Gamma_i^-1 E_mid,i.
 *
 * Bounds are kept by projections on half-spaces in the metric Gamma_i^-1: where the truth
 * keeps the bounds V cannot rise by them.
 */
#include "batch.h"

enum { SWEEPS = 8, ROUNDS = 200 };

size_t hd_robust_work(const hd_entries *entries, size_t n_terms, size_t n_channels)
{
    return hd_walk_work(n_terms, n_channels) + (size_t)entries->starts[6];
}

/* reach = Gamma_i xi_i of every axis, and stiffness_i = xi_i' Gamma_i xi_i. */
static void reaches(const hd_entries *entries, const hd_real *gains, const hd_real *xi,
                    hd_real *reach, hd_real stiffness[6])
{
    for (size_t i = 0; i < 6; ++i) {
        const int64_t first = entries->starts[i], last = entries->starts[i + 1];
        hd_real along = 0;
        for (int64_t e = first; e < last; ++e) {
            hd_real sum = 0;
            for (int64_t c = first; c < last; ++c)
                sum += *gains++ * xi[entries->rows[c]];
            reach[e] = sum;
            along += sum * xi[entries->rows[e]];
        }
        stiffness[i] = along;
    }
}

/* The 6 x 6 system of a step, but for theta. */
typedef struct {
    hd_real left[36];
    hd_real right[6];
    hd_real stiffness[6];
    const hd_plant *plant;
} balance;

static void solve(const balance *system, hd_real theta, hd_real d[6])
{
    hd_real left[36];

    for (size_t i = 0; i < 36; ++i)
        left[i] = system->left[i];
    for (size_t i = 0; i < 6; ++i) {
        left[7 * i] += theta * system->stiffness[i];
        d[i] = system->right[i];
    }
    hd_lock(system->plant->free_axes, left, d);
    hd_cholesky_solve(left, d);
}

/* |D|_M */
static hd_real size_of(const hd_real mass[36], const hd_real error[6])
{
    hd_real momentum[6], square = 0;

    hd_momentum(mass, error, momentum);
    for (size_t i = 0; i < 6; ++i)
        square += error[i] * momentum[i];
    return square > 0 ? hd_sqrt(square) : 0;
}

static hd_real excess(hd_real size, hd_real dead_zone)
{
    return size > dead_zone ? size - dead_zone : 0;
}

/* What theta ought to be if this d is the mid-step error. */
static hd_real share(const balance *system, const hd_real d[6], const hd_real error[6],
                     hd_real before, hd_real dead_zone)
{
    hd_real next[6];

    for (size_t i = 0; i < 6; ++i)
        next[i] = 2 * d[i] - error[i];
    const hd_real after = size_of(system->plant->mass, next);
    const hd_real e = excess(before, dead_zone), f = excess(after, dead_zone);
    const hd_real slope = after == before || (e > 0 && f > 0) ? (hd_real)(after > dead_zone)
                                                              : (f - e) / (after - before);
    return after + before > 0 ? slope * ((e + f) / (after + before)) : 0;
}

/* Two ends of theta, the gap share(d(theta)) - theta above zero at low and below at high. */
typedef struct {
    hd_real low, high, over, under;
} bracket;

/* By false position, and by halving every third time. */
static hd_real between(const bracket *ends, int round)
{
    const hd_real part = round % 3 == 2 ? (hd_real)0.5 : ends->over / (ends->over - ends->under);

    return ends->low + (ends->high - ends->low) * part;
}

/* d and theta that belong to each other. */
static hd_real settle(const balance *system, const hd_real error[6], hd_real dead_zone,
                      hd_real d[6])
{
    if (!(dead_zone > 0)) {
        solve(system, 1, d);
        return 1;
    }
    const hd_real before = size_of(system->plant->mass, error);
    bracket ends = {0, 1, 0, 0};
    solve(system, 0, d);
    ends.over = share(system, d, error, before, dead_zone);
    if (!(ends.over > 0))
        return 0;
    solve(system, 1, d);
    ends.under = share(system, d, error, before, dead_zone) - 1;
    for (int round = 0; round < ROUNDS && ends.under < 0 && ends.over > 0; ++round) {
        const hd_real theta = between(&ends, round);
        if (!(ends.low < theta && theta < ends.high) && round % 3 == 2)
            break; /* neighbours: no number lies between */
        solve(system, theta, d);
        const hd_real gap = share(system, d, error, before, dead_zone) - theta;
        if (gap > 0) {
            ends.low = theta;
            ends.over = gap;
        } else {
            ends.high = theta;
            ends.under = gap;
        }
    }
    const hd_real theta = ends.over < -ends.under ? ends.low : ends.high;
    solve(system, theta, d);
    return theta;
}

/* Put the coefficients of one axis inside their bounds. */
static void bound(const hd_robust *robust, const hd_real *gain, size_t first, size_t n,
                  hd_real *coefficients)
{
    int moved = 1;

    for (int sweep = 0; sweep < SWEEPS && moved; ++sweep) {
        moved = 0;
        for (size_t j = 0; j < n; ++j) {
            const size_t e = first + j;
            const hd_real found = coefficients[e];
            const hd_real wanted = found < robust->lower[e]   ? robust->lower[e]
                                   : found > robust->upper[e] ? robust->upper[e]
                                                              : found;
            if (wanted == found || !(gain[(n + 1) * j] > 0))
                continue;
            const hd_real step = (wanted - found) / gain[(n + 1) * j];
            for (size_t c = 0; c < n; ++c)
                coefficients[first + c] += gain[n * j + c] * step;
            coefficients[e] = wanted;
            moved = 1;
        }
    }
}

static void move(const hd_entries *entries, const hd_robust *robust, const hd_real *reach,
                 hd_real h, hd_real theta, const hd_real d[6], hd_real *coefficients)
{
    const hd_real leak = h * robust->leakage, keep = 1 / (1 + leak / 2);
    const hd_real *gain = robust->gains;

    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = hd_entries_on(entries, i);
        const hd_real push = h * (theta * d[i]);
        for (size_t e = first; e < first + n; ++e)
            coefficients[e] -= keep * (push * reach[e] + leak * (coefficients[e] - robust->rest[e]));
        bound(robust, gain, first, n, coefficients);
        gain += n * n;
    }
}

/* kappa at mid-step but for what the error moves it: kappa + leak/2 rest, over 1 + leak/2. */
static void leaked(const hd_entries *entries, const hd_robust *robust, hd_real h,
                   const hd_real *coefficients, const hd_real *xi, hd_real force[6])
{
    const hd_real half_leak = h * robust->leakage / 2, keep = 1 / (1 + half_leak);

    for (size_t i = 0; i < 6; ++i) {
        hd_real sum = 0;
        for (int64_t e = entries->starts[i]; e < entries->starts[i + 1]; ++e)
            sum += (coefficients[e] + half_leak * robust->rest[e]) * xi[entries->rows[e]];
        force[i] = keep * sum;
    }
}

static void midpoint(const hd_plant *plant, const hd_entries *entries, const hd_robust *robust,
                     const hd_adapting *adapting, const hd_step *step, hd_real *reach)
{
    const hd_real half = (hd_real)0.5, h = step->length;
    const hd_real keep = 1 / (1 + half * (h * robust->leakage));
    hd_real *coefficients = adapting->coefficients, *error = adapting->error;
    hd_real moved[6], momentum[6], known[6], unknown[6], d[6];
    balance system;

    system.plant = plant;
    reaches(entries, robust->gains, step->xi, reach, system.stiffness);
    hd_known_force(entries, step->xi, plant->n_terms, known);
    leaked(entries, robust, h, coefficients, step->xi, unknown);
    for (size_t i = 0; i < 6; ++i)
        moved[i] = (2 * error[i] - step->change[i]) / h;
    hd_momentum(plant->mass, moved, momentum);
    for (size_t i = 0; i < 36; ++i)
        system.left[i] = 2 / h * plant->mass[i];
    for (size_t i = 0; i < 6; ++i) {
        system.left[7 * i] += robust->a[i];
        system.stiffness[i] *= half * h * keep;
        system.right[i] = momentum[i] + step->forcing[i] + (known[i] + unknown[i]);
    }
    const hd_real theta = settle(&system, error, robust->dead_zone, d);
    move(entries, robust, reach, h, theta, d, coefficients);
    for (size_t i = 0; i < 6; ++i)
        error[i] = 2 * d[i] - error[i];
    for (int64_t e = 0; e < entries->starts[6]; ++e)
        adapting->sum[e] += h * coefficients[e];
    *adapting->duration += h;
}

void hd_robust_step(const hd_plant *plant, const hd_entries *entries, const hd_robust *robust,
                    const hd_adapting *adapting, const hd_sample *previous,
                    const hd_sample *current, hd_real *work)
{
    hd_walk walk;

    hd_walk_from(plant, previous, &walk, work);
    hd_walk_to(plant, current, &walk);
    midpoint(plant, entries, robust, adapting, &walk.step,
             work + hd_walk_work(plant->n_terms, plant->n_channels));
}

static void store(const hd_history *history, size_t place, size_t n, hd_real time,
                  const hd_adapting *adapting)
{
    history->time[place] = time;
    for (size_t i = 0; i < 6; ++i)
        history->error[6 * place + i] = adapting->error[i];
    for (size_t e = 0; e < n; ++e)
        history->matrix[n * place + e] = adapting->coefficients[e];
}

static void clear(hd_real *numbers, size_t n)
{
    for (size_t i = 0; i < n; ++i)
        numbers[i] = 0;
}

void hd_robust_run(const hd_plant *plant, const hd_entries *entries, const hd_robust *robust,
                   const hd_adapting *adapting, size_t from, const hd_record *record,
                   const int64_t *segments, size_t n_segments, const hd_history *history,
                   hd_real *work)
{
    const size_t n = (size_t)entries->starts[6];
    hd_real *reach = work + hd_walk_work(plant->n_terms, plant->n_channels);
    size_t count = 0;
    hd_walk walk;

    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        const hd_sample first = hd_sample_at(record, start);
        hd_walk_from(plant, &first, &walk, work);
        clear(adapting->error, 6);
        for (size_t k = start + 1; k < stop; ++k) {
            const hd_sample current = hd_sample_at(record, k);
            hd_walk_to(plant, &current, &walk);
            if (count == from) {
                clear(adapting->sum, n);
                *adapting->duration = 0;
            }
            midpoint(plant, entries, robust, adapting, &walk.step, reach);
            ++count;
            if (history->every && count % history->every == 0)
                store(history, count / history->every - 1, n, current.time, adapting);
        }
    }
}
