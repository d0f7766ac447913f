/* The adaptive identifier of eqs. 15-16 by the implicit midpoint rule.
 *
 * With d the error at mid-step, xi the mean of the terms at both samples and
 * f the mean of H(M nu) nu + wrench, one step of length h solves
 *
 *   (2M/h + diag(a_i + h/2 sum_j gamma_ij xi_j^2)) d
 *       = 2M D_k/h + f + K_k xi - M (nu_{k+1} - nu_k)/h
 *   K_{k+1} = K_k - h gamma o (d xi^T),    D_{k+1} = 2d - D_k.
 *
 * It is stable at every h, and V = 1/2 D'MD + 1/2 sum (K - K_true)_ij^2/gamma_ij
 * changes by exactly -h d'diag(a)d + h d.eps: the proof of eq. 23 in discrete time.
 */
#include "hydrodamp.h"

size_t hd_adapt_work(size_t n_terms, size_t n_channels)
{
    return hd_atom_count(n_channels) + 3 * n_terms;
}

/* One end of a step: velocity on the free axes, H(M nu) nu + wrench, and xi. */
typedef struct {
    hd_real velocity[6];
    hd_real known[6];
    hd_real *xi;
} end;

static void evaluate(const hd_plant *plant, const hd_sample *sample, const hd_real *channels,
                     hd_real propulsion_speed, hd_real *atoms, end *at)
{
    for (size_t i = 0; i < 6; ++i)
        at->velocity[i] = plant->free_axes[i] ? sample->velocity[i] : 0;
    hd_atoms(at->velocity, sample->down, channels, plant->n_channels, propulsion_speed, atoms, 1);
    hd_terms(plant->factors, plant->n_terms, atoms, at->xi);
    hd_coriolis(plant->mass, at->velocity, at->known);
    for (size_t i = 0; i < 6; ++i)
        at->known[i] += sample->wrench[i];
}

/* force = K xi and stiffness_i = sum_j gamma_ij xi_j^2 in one sweep */
static void sums(const hd_real *matrix, const hd_real *gamma, const hd_real *xi, size_t n_terms,
                 hd_real force[6], hd_real stiffness[6])
{
    hd_real k[6] = {0}, s[6] = {0};

    for (size_t j = 0; j < n_terms; ++j) {
        const hd_real x = xi[j], square = x * x;
        for (size_t i = 0; i < 6; ++i) {
            k[i] += matrix[6 * j + i] * x;
            s[i] += gamma[6 * j + i] * square;
        }
    }
    for (size_t i = 0; i < 6; ++i) {
        force[i] = k[i];
        stiffness[i] = s[i];
    }
}

/* K -= h gamma o (xi d'); each row is read whole before it is written */
static void move(hd_real *matrix, const hd_real *gamma, const hd_real *xi, size_t n_terms,
                 hd_real h, const hd_real d[6])
{
    for (size_t j = 0; j < n_terms; ++j) {
        const hd_real reach = h * xi[j];
        hd_real row[6];
        for (size_t i = 0; i < 6; ++i)
            row[i] = matrix[6 * j + i] - gamma[6 * j + i] * (reach * d[i]);
        for (size_t i = 0; i < 6; ++i)
            matrix[6 * j + i] = row[i];
    }
}

/* Replace the rows and columns of locked axes by those of the identity. */
static void lock(const unsigned char free_axes[6], hd_real left[36], hd_real right[6])
{
    for (size_t i = 0; i < 6; ++i) {
        if (free_axes[i])
            continue;
        for (size_t k = 0; k < 6; ++k)
            left[6 * i + k] = left[6 * k + i] = 0;
        left[7 * i] = 1;
        right[i] = 0;
    }
}

static void midpoint(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                     hd_real *matrix, hd_real error[6], hd_real h, const end *first,
                     const end *last, hd_real *xi)
{
    const hd_real half = (hd_real)0.5;
    hd_real moved[6], momentum[6], damping[6], stiffness[6], left[36], d[6];

    for (size_t j = 0; j < plant->n_terms; ++j)
        xi[j] = half * (first->xi[j] + last->xi[j]);
    sums(matrix, gamma, xi, plant->n_terms, damping, stiffness);
    for (size_t i = 0; i < 6; ++i) /* 2M D/h - M (nu_{k+1} - nu_k)/h, one product */
        moved[i] = (2 * error[i] - (last->velocity[i] - first->velocity[i])) / h;
    hd_momentum(plant->mass, moved, momentum);
    for (size_t i = 0; i < 36; ++i)
        left[i] = 2 / h * plant->mass[i];
    for (size_t i = 0; i < 6; ++i) {
        left[7 * i] += a[i] + half * h * stiffness[i];
        d[i] = momentum[i] + half * (first->known[i] + last->known[i]) + damping[i];
    }
    lock(plant->free_axes, left, d);
    hd_cholesky_solve(left, d);
    move(matrix, gamma, xi, plant->n_terms, h, d);
    for (size_t i = 0; i < 6; ++i)
        error[i] = 2 * d[i] - error[i];
}

/* Both ends of a step share the workspace: atoms, xi at either end, their mean. */
static hd_real *place_ends(const hd_plant *plant, hd_real *work, end ends[2])
{
    ends[0].xi = work + hd_atom_count(plant->n_channels);
    ends[1].xi = ends[0].xi + plant->n_terms;
    return ends[1].xi + plant->n_terms;
}

void hd_adapt_step(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                   hd_real *matrix, hd_real error[6], const hd_sample *previous,
                   const hd_sample *current, hd_real *work)
{
    end ends[2];
    hd_real *xi = place_ends(plant, work, ends);

    evaluate(plant, previous, previous->channels, previous->opening, work, &ends[0]);
    evaluate(plant, current, previous->channels, current->closing, work, &ends[1]);
    midpoint(plant, a, gamma, matrix, error, current->time - previous->time, &ends[0], &ends[1],
             xi);
}

static hd_sample sample_at(const hd_record *record, size_t k)
{
    const hd_sample sample = {
        record->time[k],           record->velocity + 6 * k,
        record->down + 3 * k,      record->wrench + 6 * k,
        record->channels + record->n_channels * k,
        record->propulsion[2 * k], record->propulsion[2 * k + 1],
    };

    return sample;
}

static void store(const hd_history *history, size_t place, size_t n_terms, hd_real time,
                  const hd_real error[6], const hd_real *matrix)
{
    history->time[place] = time;
    for (size_t i = 0; i < 6; ++i)
        history->error[6 * place + i] = error[i];
    for (size_t i = 0; i < 6 * n_terms; ++i)
        history->matrix[6 * n_terms * place + i] = matrix[i];
}

/* Whether the step after `sample` holds what was held up to it, so that its values there
 * need no second evaluation. */
static int holds_on(const hd_plant *plant, const hd_sample *before, const hd_sample *sample)
{
    for (size_t i = 0; i < plant->n_channels; ++i)
        if (!(before->channels[i] == sample->channels[i]))
            return 0;
    return sample->closing == sample->opening;
}

void hd_adapt(const hd_plant *plant, const hd_real a[6], const hd_real *gamma, hd_real *matrix,
              hd_real error[6], const hd_record *record, const int64_t *segments,
              size_t n_segments, size_t passes, const hd_history *history, hd_real *work)
{
    size_t count = 0;
    end ends[2];
    hd_real *xi = place_ends(plant, work, ends);

    for (size_t run = 0; run < passes * n_segments; ++run) {
        const size_t start = (size_t)segments[2 * (run % n_segments)];
        const size_t stop = (size_t)segments[2 * (run % n_segments) + 1];
        hd_sample previous = sample_at(record, start);
        int fresh = 0; /* whether ends[0] holds the previous sample already */
        for (size_t i = 0; i < 6; ++i)
            error[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            const hd_sample current = sample_at(record, k);
            if (!fresh)
                evaluate(plant, &previous, previous.channels, previous.opening, work, &ends[0]);
            evaluate(plant, &current, previous.channels, current.closing, work, &ends[1]);
            midpoint(plant, a, gamma, matrix, error, current.time - previous.time, &ends[0],
                     &ends[1], xi);
            const end swapped = ends[0];
            ends[0] = ends[1];
            ends[1] = swapped;
            fresh = holds_on(plant, &previous, &current);
            previous = current;
            ++count;
            if (history->every && count % history->every == 0)
                store(history, count / history->every - 1, plant->n_terms, current.time, error,
                      matrix);
        }
    }
}
