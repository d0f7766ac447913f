/* Replay: eq. 1 integrated by RK4 between samples, open loop, and its derivative.
 *
 * A stage has the rate k = f(x + c h k_before) of the state x: velocity and, where simulated,
 * quaternion. With J = df/dx and B the derivative of f on the coefficients, at each stage,
 *
 *   dx_next = Phi dx + sum over stages of W B,    W_4 = h/6,       W_3 = h/3 + h W_4 J_4,
 *   Phi = 1 + sum over stages of W J,             W_2 = h/3 + h/2 W_3 J_3,
 *                                                 W_1 = h/6 + h/2 W_2 J_2.
 *
 * B of coefficient (term, axis) is the axis' column of the inverse mass times xi_term: one
 * Phi and four W serve all coefficients. A parameter of the plant has B = M^-1 times the change of
 * H(M nu) nu + K xi + wrench - M a at the acceleration a. The normalisation is differentiated too.
 */
#include "batch.h"

enum { MAX_STATES = 10 }; /* states: 6 velocities, and 4 of the quaternion where it is simulated */

static const hd_real slack = (hd_real)1e-6; /* rounding of clocks: 0.1 s is two steps of 0.05 s */

/* Between two samples. */
typedef struct {
    const hd_real *wrench[2], *down[2], *channels;
    hd_real slopes[2][3]; /* of down at both ends, times the length, less its change */
    hd_real propulsion_speed;
    size_t sample; /* the first */
    size_t steps; /* equal sub-steps */
    hd_real h;    /* s, of each */
} interval;

typedef struct {
    const hd_motion *motion;
    hd_real inverse[36];
    size_t n; /* states */
    const int32_t *parameters;
    size_t n_coefficients, n_parameters; /* coefficients first */
    hd_real *forces; /* 4 x 6 x parameters of the plant: changes of the force, by stage */
    hd_real *atoms, *xi, *weights; /* xi: 4 x n_terms, one a stage */
    hd_real *accelerations; /* n_terms x 6: inverse mass times each term's coefficients */
    hd_real coriolis_slopes[6][36]; /* inverse mass times the slope of H at each unit velocity */
    hd_real *rows; /* (p + 6) x n: d state / d parameter; NULL without derivatives */
    hd_real *sum;  /* (p + 6) x n: of the rows of a block of samples */
    size_t block;  /* samples */
    const hd_filter *filter; /* or NULL */
    hd_real *transition;     /* 6 x 6: with a filter, the product of Phi since the last sample */
} integrator;

size_t hd_replay_work(const hd_plant *plant, size_t n_parameters)
{
    return 7 * hd_atom_count(plant->n_channels) + 10 * plant->n_terms
           + 2 * MAX_STATES * (n_parameters + 6) + 24 * n_parameters;
}

static interval interval_after(const hd_motion *motion, size_t k)
{
    const hd_record *record = motion->record;
    const hd_real length = record->time[k + 1] - record->time[k];
    const hd_real ratio = length / motion->max_step * (1 - slack);
    const size_t steps = ratio > 1 ? (size_t)hd_ceil(ratio) : 1;
    interval between = {
        {record->wrench + 6 * k, record->wrench + 6 * (k + 1)},
        {record->down + 3 * k, record->down + 3 * (k + 1)},
        record->channels + record->n_channels * k,
        {{0}},
        record->propulsion[2 * k],
        k,
        steps,
        length / (hd_real)steps,
    };

    for (size_t i = 0; i < 6; ++i) { /* three of each end */
        const hd_real change = between.down[1][i % 3] - between.down[0][i % 3];
        between.slopes[i / 3][i % 3] = motion->down_slope[3 * k + i] * length - change;
    }
    return between;
}

static void interpolate(const hd_real *const ends[2], hd_real fraction, size_t n, hd_real *out)
{
    for (size_t i = 0; i < n; ++i)
        out[i] = ends[0][i] + fraction * (ends[1][i] - ends[0][i]);
}

/* The time derivative of a state; its atoms and xi are stored for state_slope. */
static void state_rate(const integrator *d, const interval *at, const hd_real *state,
                       hd_real fraction, hd_real *rate, hd_real *xi)
{
    hd_real wrench[6], down[3];

    interpolate(at->wrench, fraction, 6, wrench);
    if (d->n > 6) {
        hd_down(state + 6, down);
        hd_quaternion_rate(state + 6, state + 3, rate + 6);
    } else {
        interpolate(at->down, fraction, 3, down);
        for (size_t i = 0; i < 3; ++i)
            down[i] += fraction * (1 - fraction)
                       * ((1 - fraction) * at->slopes[0][i] - fraction * at->slopes[1][i]);
    }
    hd_acceleration(d->motion->plant, d->inverse, d->motion->matrix, state, down, wrench,
                    at->channels, at->propulsion_speed, rate, d->atoms, xi);
}

/* out[n][m] = a[n][l] b[l][m]; rows of a and of out may be longer */
static inline void product(const hd_real *restrict a, size_t a_row, const hd_real *restrict b,
                           size_t n, size_t l, size_t m, hd_real *restrict out, size_t out_row)
{
    for (size_t i = 0; i < n; ++i) {
        hd_real row[MAX_STATES] = {0};
        for (size_t k = 0; k < l; ++k)
            for (size_t j = 0; j < m; ++j)
                row[j] += a[a_row * i + k] * b[m * k + j];
        for (size_t j = 0; j < m; ++j)
            out[out_row * i + j] = row[j];
    }
}

/* slope (n x n) = d rate / d state, from the atoms that state_rate stored. */
static void state_slope(const integrator *d, const interval *at, const hd_real *state,
                        hd_real *slope)
{
    const hd_plant *plant = d->motion->plant;
    const size_t n = d->n;
    hd_real columns[36], down[12], by_omega[12], by_itself[16];

    hd_atom_weights(plant->factors, plant->n_terms, d->atoms, hd_atom_count(plant->n_channels),
                    d->accelerations, d->weights);
    hd_atom_slopes(state, at->propulsion_speed, d->weights, columns);
    for (size_t l = 0; l < 6; ++l)
        for (size_t i = 0; i < 36; ++i)
            columns[i] += state[l] * d->coriolis_slopes[l][i];
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < 6; ++k)
            slope[n * i + k] = columns[6 * k + i];
    if (n == 6)
        return;
    hd_down_slope(state + 6, down);
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < 4; ++k) {
            slope[n * i + 6 + k] = 0;
            for (size_t l = 0; l < 3; ++l)
                slope[n * i + 6 + k] += d->weights[6 * (18 + l) + i] * down[4 * l + k];
        }
    hd_quaternion_by_omega(state + 6, by_omega);
    hd_quaternion_by_itself(state + 3, by_itself);
    for (size_t i = 0; i < 4; ++i)
        for (size_t k = 0; k < n; ++k)
            slope[n * (6 + i) + k] = k < 3   ? 0
                                     : k < 6 ? by_omega[3 * i + k - 3]
                                             : by_itself[4 * i + k - 6];
}

/* The changes of the force with the parameters of the plant, at the state and the rate of a stage,
 * from what state_slope stored. */
static void plant_forces(const integrator *d, const interval *at, const hd_real *velocity,
                         const hd_real *rate, hd_real fraction, const hd_real *xi, hd_real *force)
{
    const hd_plant *plant = d->motion->plant;
    const hd_plant_slopes *slopes = d->motion->slopes;
    const size_t n = d->motion->record->n, m = plant->n_channels;
    const hd_real *weights = d->weights + 6 * HD_FIXED_ATOMS; /* of the channels */

    for (size_t k = 0; k < d->n_parameters - d->n_coefficients; ++k, force += 6) {
        const hd_real *wrench = slopes->wrench + 6 * (n * k + at->sample);
        const hd_real *ends[2] = {wrench, wrench + 6};
        const hd_real *channels = slopes->channels + m * (n * k + at->sample);
        hd_real product[6], moving[6], acceleration[6] = {0};

        interpolate(ends, fraction, 6, force);
        hd_coriolis(slopes->mass + 36 * k, velocity, moving);
        hd_momentum(slopes->mass + 36 * k, rate, product);
        for (size_t i = 0; i < 6; ++i)
            force[i] += moving[i] - product[i];
        for (size_t j = 0; j < slopes->n_known; ++j)
            for (size_t i = 0; i < 6; ++i)
                force[i] += slopes->matrix[6 * (slopes->n_known * k + j) + i] * xi[j];
        for (size_t c = 0; c < m; ++c) {
            const hd_real sign = (hd_real)((at->channels[c] > 0) - (at->channels[c] < 0));
            for (size_t i = 0; i < 6; ++i)
                acceleration[i] += channels[c] * (weights[6 * c + i] + sign * weights[6 * (m + c) + i]);
        }
        hd_momentum(plant->mass, acceleration, product);
        for (size_t i = 0; i < 6; ++i)
            force[i] += product[i];
    }
}

/* Rows 6 to 9 of a matrix of m columns: X <- (X - q q'X) / |q|. */
static void normalise_rows(const hd_real q[4], hd_real length, size_t m, hd_real *matrix)
{
    for (size_t c = 0; c < m; ++c) {
        hd_real projection = 0;
        for (size_t i = 0; i < 4; ++i)
            projection += q[i] * matrix[m * (6 + i) + c];
        for (size_t i = 0; i < 4; ++i)
            matrix[m * (6 + i) + c] = (matrix[m * (6 + i) + c] - q[i] * projection) / length;
    }
}

/* Propagate each row of d->rows over a step: transition is Phi, gain[s] is W_s M^-1. */
static inline void propagate_rows(const integrator *d, size_t n, const hd_real *transition,
                             hd_real gain[4][6 * MAX_STATES])
{
    const size_t n_terms = d->motion->plant->n_terms;
    const size_t n_changes = d->n_parameters - d->n_coefficients;
    hd_real columns[MAX_STATES * MAX_STATES], by_axis[6][4][MAX_STATES];

    for (size_t i = 0; i < n; ++i) {
        for (size_t k = 0; k < n; ++k)
            columns[n * k + i] = transition[n * i + k];
        for (size_t s = 0; s < 4; ++s)
            for (size_t axis = 0; axis < 6; ++axis)
                by_axis[axis][s][i] = gain[s][6 * i + axis];
    }
    for (size_t c = 0; c < d->n_parameters + 6; ++c) {
        hd_real *row = d->rows + n * c, sum[MAX_STATES] = {0};
        for (size_t k = 0; k < n; ++k)
            for (size_t i = 0; i < n; ++i)
                sum[i] += columns[n * k + i] * row[k];
        if (c < d->n_coefficients)
            for (size_t s = 0; s < 4; ++s) {
                const hd_real x = d->xi[n_terms * s + (size_t)d->parameters[2 * c]];
                const hd_real *by = by_axis[d->parameters[2 * c + 1]][s];
                for (size_t i = 0; i < n; ++i)
                    sum[i] += by[i] * x;
            }
        else if (c < d->n_parameters)
            for (size_t s = 0; s < 4; ++s) {
                const hd_real *force = d->forces + 6 * (n_changes * s + c - d->n_coefficients);
                for (size_t axis = 0; axis < 6; ++axis)
                    for (size_t i = 0; i < n; ++i)
                        sum[i] += by_axis[axis][s][i] * force[axis];
            }
        for (size_t i = 0; i < n; ++i)
            row[i] = sum[i];
    }
}

/* The derivative of the step of length h that ended in the quaternion q, of the length given
 * before its normalisation. */
static inline void differentiate(const integrator *d, size_t n, hd_real h,
                                 hd_real slopes[4][MAX_STATES * MAX_STATES], const hd_real *q,
                                 hd_real length)
{
    static const hd_real share[3] = {1, 2, 2}; /* sixths */
    static const hd_real ahead[3] = {(hd_real)0.5, (hd_real)0.5, 1};
    hd_real weight[MAX_STATES * MAX_STATES], weighted[MAX_STATES * MAX_STATES];
    hd_real transition[MAX_STATES * MAX_STATES];
    hd_real gain[4][6 * MAX_STATES];

    for (size_t i = 0; i < n * n; ++i) { /* W_4 is h/6 times the unit matrix */
        weighted[i] = h / 6 * slopes[3][i];
        transition[i] = (hd_real)(i % (n + 1) == 0) + weighted[i];
    }
    for (size_t i = 0; i < n; ++i)
        for (size_t k = 0; k < 6; ++k)
            gain[3][6 * i + k] = i < 6 ? h / 6 * d->inverse[6 * i + k] : 0;
    for (size_t s = 3; s-- > 0;) {
        for (size_t i = 0; i < n * n; ++i)
            weight[i] = h * (ahead[s] * weighted[i]) + (i % (n + 1) == 0 ? h / 6 * share[s] : 0);
        product(weight, n, slopes[s], n, n, n, weighted, n);
        product(weight, n, d->inverse, n, 6, 6, gain[s], 6);
        for (size_t i = 0; i < n * n; ++i)
            transition[i] += weighted[i];
    }
    if (n > 6) {
        normalise_rows(q, length, n, transition);
        for (size_t s = 0; s < 4; ++s)
            normalise_rows(q, length, 6, gain[s]);
    }
    propagate_rows(d, n, transition, gain);
    if (d->filter) {
        product(transition, 6, d->transition, 6, 6, 6, weighted, 6);
        for (size_t i = 0; i < 36; ++i)
            d->transition[i] = weighted[i];
    }
}

/* One classical Runge-Kutta step, sub-step `index` of the interval. */
static void rk4(const integrator *d, const interval *at, size_t index, hd_real *state)
{
    static const hd_real node[4] = {0, (hd_real)0.5, (hd_real)0.5, 1};
    const size_t n = d->n;
    const hd_real h = at->h;
    hd_real stage[MAX_STATES], k[5][MAX_STATES] = {{0}}, slopes[4][MAX_STATES * MAX_STATES];
    hd_real length = 1;

    for (size_t s = 0; s < 4; ++s) { /* k[0] is none, k[1] to k[4] are the stages' rates */
        const hd_real fraction = ((hd_real)index + node[s]) / (hd_real)at->steps;
        for (size_t i = 0; i < n; ++i)
            stage[i] = state[i] + node[s] * h * k[s][i];
        state_rate(d, at, stage, fraction, k[s + 1], d->xi + d->motion->plant->n_terms * s);
        if (!d->rows)
            continue;
        state_slope(d, at, stage, slopes[s]);
        plant_forces(d, at, stage, k[s + 1], fraction, d->xi + d->motion->plant->n_terms * s,
                     d->forces + 6 * (d->n_parameters - d->n_coefficients) * s);
    }
    for (size_t i = 0; i < n; ++i)
        state[i] += h / 6 * (k[1][i] + 2 * k[2][i] + 2 * k[3][i] + k[4][i]);
    if (n > 6)
        length = hd_normalise(state + 6);
    if (d->rows && n == 6) /* a constant number of states lets the compiler unroll the loops */
        differentiate(d, 6, h, slopes, NULL, length);
    else if (d->rows)
        differentiate(d, MAX_STATES, h, slopes, state + 6, length);
}

static void start_at(const integrator *d, size_t start, hd_real *state)
{
    const hd_motion *motion = d->motion;
    const size_t p = d->n_parameters, n = d->n;

    for (size_t i = 0; i < 6; ++i)
        state[i] = motion->plant->free_axes[i] ? motion->record->velocity[6 * start + i] : 0;
    if (motion->attitude) {
        for (size_t i = 0; i < 4; ++i)
            state[6 + i] = motion->attitude[4 * start + i];
        (void)hd_normalise(state + 6);
    }
    if (!d->rows)
        return;
    for (size_t i = 0; i < n * (p + 6); ++i)
        d->rows[i] = 0;
    for (size_t i = 0; i < 6; ++i)
        d->rows[n * (p + i) + i] = motion->plant->free_axes[i] ? 1 : 0;
}

/* 1 if a velocity component is not finite or beyond the limit. */
static int diverged(const hd_real velocity[6], hd_real limit)
{
    for (size_t i = 0; i < 6; ++i)
        if (!(hd_fabs(velocity[i]) <= limit)) /* true for NaN as well */
            return 1;
    return 0;
}

/* Adds the rows of one sample to their block's sum; the last sample of a block, of `count`
 * samples, writes it to slope[6][p + 6]. */
static void add_rows(const integrator *d, size_t count, int last, hd_real *slope)
{
    const size_t width = d->n_parameters + 6, n = d->n;
    const hd_real share = 1 / hd_sqrt((hd_real)count);

    for (size_t i = 0; i < width * n; ++i)
        d->sum[i] = (count > 1 ? d->sum[i] : 0) + d->rows[i];
    for (size_t i = 0; last && i < 6; ++i)
        for (size_t c = 0; c < width; ++c)
            slope[i * width + c] = share * d->sum[n * c + i];
}

/* Integrate one segment; returns its first bad sample or -1. */
static int64_t replay_segment(const integrator *d, size_t start, size_t stop, hd_real *velocity,
                              hd_real *jacobian)
{
    const size_t width = 6 * (d->n_parameters + 6);
    hd_real state[MAX_STATES];

    start_at(d, start, state);
    if (d->filter)
        hd_filter_start(d->filter);
    for (size_t k = start; k < stop; ++k) {
        if (k > start) {
            const interval at = interval_after(d->motion, k - 1);
            for (size_t i = 0; d->filter && i < 36; ++i)
                d->transition[i] = i % 7 == 0;
            for (size_t i = 0; i < at.steps; ++i)
                rk4(d, &at, i, state);
            if (d->filter)
                hd_filter_predict(d->filter, d->transition, d->inverse,
                                  at.h * (hd_real)at.steps, state, d->rows);
        }
        if (diverged(state, d->motion->limit))
            return (int64_t)k;
        if (d->filter) {
            hd_filter_update(d->filter, d->motion->plant->free_axes, k, state, d->rows,
                             velocity + 6 * k, jacobian + width * (k - start));
            continue;
        }
        for (size_t i = 0; i < 6; ++i)
            velocity[6 * k + i] = state[i];
        if (d->rows)
            add_rows(d, (k - start) % d->block + 1,
                     k + 1 == stop || (k + 1 - start) % d->block == 0,
                     jacobian + width * ((k - start) / d->block));
    }
    return -1;
}

void hd_replay(const hd_motion *motion, const int64_t *segments, size_t n_segments,
               const int32_t *parameters, size_t n_parameters, size_t block,
               const hd_filter *filter, hd_real *velocity, hd_real *jacobian,
               int64_t *diverged_at, hd_real *work)
{
    const size_t n_atoms = hd_atom_count(motion->plant->n_channels);
    const size_t width = 6 * (n_parameters + 6);
    hd_real transition[36];
    integrator d;

    d.motion = motion;
    d.filter = filter;
    d.transition = transition;
    hd_mass_inverse(motion->plant, d.inverse);
    d.n = motion->attitude ? MAX_STATES : 6;
    d.parameters = parameters;
    d.n_parameters = n_parameters;
    d.n_coefficients = n_parameters - (motion->slopes ? motion->slopes->n : 0);
    d.atoms = work;
    d.xi = d.atoms + n_atoms;
    d.weights = d.xi + 4 * motion->plant->n_terms;
    d.accelerations = d.weights + 6 * n_atoms;
    d.rows = jacobian ? d.accelerations + 6 * motion->plant->n_terms : NULL;
    d.sum = jacobian ? d.rows + d.n * (n_parameters + 6) : NULL;
    d.forces = jacobian ? d.sum + d.n * (n_parameters + 6) : NULL;
    d.block = block;
    for (size_t j = 0; jacobian && j < motion->plant->n_terms; ++j)
        hd_momentum(d.inverse, motion->matrix + 6 * j, d.accelerations + 6 * j);
    for (size_t l = 0; jacobian && l < 6; ++l) {
        hd_real unit[6] = {0}, slope[36];
        unit[l] = 1;
        hd_coriolis_slope(motion->plant->mass, unit, slope);
        for (size_t k = 0; k < 6; ++k)
            hd_momentum(d.inverse, slope + 6 * k, d.coriolis_slopes[l] + 6 * k);
    }
    for (size_t i = 0; i < 6 * motion->record->n; ++i)
        velocity[i] = (hd_real)NAN;
    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        const size_t n = jacobian ? width * ((stop - start + block - 1) / block) : 0;
        for (size_t i = 0; i < n; ++i)
            jacobian[i] = (hd_real)NAN;
        diverged_at[s] = replay_segment(&d, start, stop, velocity, jacobian);
        jacobian = jacobian ? jacobian + n : NULL;
    }
}
