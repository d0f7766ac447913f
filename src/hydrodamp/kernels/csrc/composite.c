/* The composite adaptive identifier: eqs. 15-16 with a memory of the filtered equation.
 *
 * With z <- z + c (z_step - z), c = rate h / (1 + rate h), for the terms and for
 * M (nu_{k+1} - nu_k)/h - f, every step adds y_i = kappa_i . phi to S_i and Q_i of its axis:
 *
 *   S += h/length phi phi',   Q += h/length phi y
 *
 * The step of adaptive.c follows with the gain gamma_i (I + S_old)^-1 of its axis in place of the
 * diagonal. At the end of a block of time the coefficients move to what they remember,
 *
 *   (I + S_old + kappa S)(K_new - K) = kappa (Q - S K),   S_old <- S,
 *
 * and S, Q lose the share `forgetting`. While data satisfy the equation,
 *
 *   V = 1/2 D'MD + 1/2 sum_i (K - K_true)_i'(I + S_old)(K - K_true)_i / gamma_i
 *
 * does not grow: the step of eq. 15 changes it by -h d'diag(a)d. At the end of a block the error E
 * satisfies (I + S_old + kappa S) E_new = (I + S_old) E, so
 * E'(I + S_old)E >= E_new'(I + S_old + 2 kappa S)E_new >= E_new'(I + S)E_new for kappa >= 1/2,
 * whatever the lengths of steps and blocks.
 */
#include "onboard.h"

typedef struct {
    hd_real *matrix, *error, *terms, *target, *elapsed, *blocks, *axes;
} hd_memory;

static hd_memory memory_in(hd_real *state, size_t n_terms)
{
    hd_memory m;

    m.matrix = state;
    m.error = m.matrix + 6 * n_terms;
    m.terms = m.error + 6;
    m.target = m.terms + n_terms;
    m.elapsed = m.target + 6;
    m.blocks = m.elapsed + 1;
    m.axes = m.blocks + 1;
    return m;
}

static size_t n_entries(const hd_entries *entries, size_t axis)
{
    return (size_t)(entries->starts[axis + 1] - entries->starts[axis]);
}

/* Of an axis: Q, S, S_old, and the factors of I + S_old. */
static size_t axis_size(size_t n)
{
    return n + 3 * n * n;
}

size_t hd_composite_size(const hd_entries *entries, size_t n_terms)
{
    size_t size = 7 * n_terms + 14;

    for (size_t i = 0; i < 6; ++i)
        size += axis_size(n_entries(entries, i));
    return size;
}

void hd_composite_begin_segment(size_t n_terms, hd_real *state)
{
    const hd_memory m = memory_in(state, n_terms);

    for (hd_real *value = m.error; value < m.blocks; ++value)
        *value = 0;
}

void hd_composite_start(const hd_entries *entries, size_t n_terms, const hd_real *coefficients,
                        hd_real *state)
{
    const size_t size = hd_composite_size(entries, n_terms);
    hd_real *axis = memory_in(state, n_terms).axes;

    for (size_t j = 0; j < size; ++j)
        state[j] = j < 6 * n_terms ? entries->known[j] : 0;
    for (size_t i = 0; i < 6; ++i) {
        const size_t n = n_entries(entries, i);
        for (int32_t j = entries->starts[i]; j < entries->starts[i + 1]; ++j)
            state[6 * (size_t)entries->rows[j] + i] = coefficients[j];
        for (size_t j = 0; j < n; ++j)
            axis[n + 2 * n * n + (n + 1) * j] = 1;
        axis += axis_size(n);
    }
}

/* One step of eq. 15; gain: one number a coefficient. */
static void adapt(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                  const hd_step *step, const hd_memory *m, hd_real *gain)
{
    hd_real force[6] = {0}, stiffness[6] = {0}, d[6];
    const hd_real *axis = m->axes;

    for (size_t j = 0; j < plant->n_terms; ++j)
        for (size_t i = 0; i < 6; ++i)
            force[i] += m->matrix[6 * j + i] * step->xi[j];
    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = n_entries(entries, i);
        for (size_t j = first; j < first + n; ++j)
            gain[j] = law->unit[j] * step->xi[entries->rows[j]];
        hd_solve(axis + n + 2 * n * n, n, gain + first);
        for (size_t j = first; j < first + n; ++j) {
            gain[j] *= law->gamma[i] * law->unit[j];
            stiffness[i] += gain[j] * step->xi[entries->rows[j]];
        }
        axis += axis_size(n);
    }
    hd_error_step(plant, law->a, force, stiffness, m->error, step, d);
    for (size_t i = 0; i < 6; ++i)
        for (int32_t j = entries->starts[i]; j < entries->starts[i + 1]; ++j)
            m->matrix[6 * (size_t)entries->rows[j] + i] -= step->length * gain[j] * d[i];
}

/* Filter the equation, and add it to the memory. Workspace: the largest n. */
static void remember(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                     const hd_step *step, const hd_memory *m, hd_real *phi)
{
    const hd_real h = step->length, weight = h / law->length;
    const hd_real share = law->rate * h / (1 + law->rate * h);
    hd_real momentum[6], target[6], *axis = m->axes;

    hd_momentum(plant->mass, step->change, momentum);
    for (size_t j = 0; j < plant->n_terms; ++j)
        m->terms[j] += share * (step->xi[j] - m->terms[j]);
    for (size_t i = 0; i < 6; ++i) {
        m->target[i] += share * (momentum[i] / h - step->forcing[i] - m->target[i]);
        target[i] = m->target[i];
    }
    for (size_t j = 0; j < plant->n_terms; ++j)
        for (size_t i = 0; i < 6; ++i)
            target[i] -= entries->known[6 * j + i] * m->terms[j];
    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = n_entries(entries, i);
        const int32_t *rows = entries->rows + first;
        hd_real *s = axis + n;
        for (size_t j = 0; j < n; ++j) {
            const size_t row = (size_t)rows[j];
            phi[j] = law->unit[first + j] * m->terms[row];
            axis[j] += weight * phi[j] * target[i];
        }
        for (size_t j = 0; j < n; ++j)
            for (size_t c = 0; c < n; ++c)
                s[n * j + c] += weight * (phi[j] * phi[c]);
        axis += axis_size(n);
    }
    *m->elapsed += h;
}

/* Move the coefficients of an axis to what it remembers, and renew its gain. */
static void recall(const hd_composite *law, size_t i, size_t first, size_t n,
                   const int32_t *rows, hd_real *matrix, hd_real *axis, hd_real *work)
{
    const hd_real *unit = law->unit + first;
    hd_real *s = axis + n, *old = s + n * n, *factors = old + n * n, *move = work + n * n;

    for (size_t j = 0; j < n; ++j)
        move[j] = law->kappa * axis[j];
    for (size_t j = 0; j < n; ++j) {
        const hd_real value = matrix[6 * (size_t)rows[j] + i];
        const hd_real scaled = unit[j] > 0 ? law->kappa * value / unit[j] : 0;
        for (size_t c = 0; c < n; ++c) {
            const hd_real identity = (hd_real)(j == c);
            move[c] -= scaled * s[n * j + c];
            work[n * j + c] = identity + old[n * j + c] + law->kappa * s[n * j + c];
            factors[n * j + c] = identity + s[n * j + c];
        }
    }
    hd_cholesky(work, n, move);
    hd_factorise(factors, n);
    for (size_t j = 0; j < n; ++j) {
        matrix[6 * (size_t)rows[j] + i] += unit[j] * move[j];
        axis[j] *= 1 - law->forgetting;
    }
    for (size_t j = 0; j < n * n; ++j) {
        old[j] = s[j];
        s[j] *= 1 - law->forgetting;
    }
}

size_t hd_composite_work(const hd_entries *entries)
{
    size_t largest = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = n_entries(entries, i);
        largest = n > largest ? n : largest;
    }
    return largest * largest + largest + (size_t)entries->starts[6];
}

int hd_composite_step(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                      const hd_step *step, hd_real *state, hd_real *work)
{
    const hd_memory m = memory_in(state, plant->n_terms);
    hd_real *axis = m.axes;

    adapt(plant, entries, law, step, &m, work);
    remember(plant, entries, law, step, &m, work);
    if (*m.elapsed + step->length / 2 < law->length) /* the whole number of steps nearest */
        return 0;
    for (size_t i = 0; i < 6; ++i) {
        const size_t first = (size_t)entries->starts[i], n = n_entries(entries, i);
        recall(law, i, first, n, entries->rows + first, m.matrix, axis, work);
        axis += axis_size(n);
    }
    *m.elapsed = 0;
    *m.blocks += 1;
    return 1;
}
