/* Replay: eq. 1 integrated by RK4 between samples, open loop. */
#include "batch.h"

typedef struct {
    const hd_plant *plant;
    const hd_real *inverse; /* 6 x 6 */
    const hd_real *matrix;
    const hd_interval *interval;
    size_t n_states; /* 6 velocities, and 4 of the quaternion where it is simulated */
    hd_real *work;
} driven;

static void state_rate(const driven *vessel, const hd_real *state, hd_real fraction,
                       hd_real *rate)
{
    const hd_interval *interval = vessel->interval;
    hd_real wrench[6], down[3];

    hd_blend(interval->wrench[0], interval->wrench[1], fraction, 6, wrench);
    if (vessel->n_states > 6) {
        hd_down(state + 6, down);
        hd_quaternion_rate(state + 6, state + 3, rate + 6);
    } else {
        hd_blend(interval->down[0], interval->down[1], fraction, 3, down);
    }
    hd_acceleration(vessel->plant, vessel->inverse, vessel->matrix, state, down, wrench,
                    interval->channels, interval->propulsion_speed, rate, vessel->work);
}

/* to = state + scale * rate */
static void ahead(const hd_real *state, hd_real scale, const hd_real *rate, size_t n, hd_real *to)
{
    for (size_t i = 0; i < n; ++i)
        to[i] = state[i] + scale * rate[i];
}

/* One classical Runge-Kutta step of length h, sub-step `index` of the interval. */
static void rk4(const driven *vessel, hd_real h, size_t index, hd_real *state)
{
    const size_t n = vessel->n_states;
    const hd_real steps = (hd_real)vessel->interval->steps, half = (hd_real)0.5;
    const hd_real begin = (hd_real)index / steps, end = (hd_real)(index + 1) / steps;
    const hd_real middle = ((hd_real)index + half) / steps;
    hd_real k1[10], k2[10], k3[10], k4[10], stage[10];

    state_rate(vessel, state, begin, k1);
    ahead(state, half * h, k1, n, stage);
    state_rate(vessel, stage, middle, k2);
    ahead(state, half * h, k2, n, stage);
    state_rate(vessel, stage, middle, k3);
    ahead(state, h, k3, n, stage);
    state_rate(vessel, stage, end, k4);
    for (size_t i = 0; i < n; ++i)
        state[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    if (n > 6)
        (void)hd_normalise(state + 6);
}

static void to_next_sample(driven *vessel, const hd_record *record, size_t k, hd_real max_step,
                           hd_real *state)
{
    const hd_interval interval = hd_interval_after(record, k, max_step);

    vessel->interval = &interval;
    for (size_t i = 0; i < interval.steps; ++i)
        rk4(vessel, interval.length / (hd_real)interval.steps, i, state);
    vessel->interval = NULL;
}

/* Integrate one segment; returns its first bad sample or -1. */
static int64_t replay_segment(driven *vessel, const hd_record *record, size_t start, size_t stop,
                              const hd_real *attitude, hd_real max_step, hd_real limit,
                              hd_real *velocity)
{
    hd_real state[10];

    for (size_t i = 0; i < 6; ++i)
        state[i] = vessel->plant->free_axes[i] ? record->velocity[6 * start + i] : 0;
    if (attitude) {
        for (size_t i = 0; i < 4; ++i)
            state[6 + i] = attitude[4 * start + i];
        (void)hd_normalise(state + 6);
    }
    for (size_t k = start; k < stop; ++k) {
        if (k > start)
            to_next_sample(vessel, record, k - 1, max_step, state);
        if (hd_diverged(state, limit))
            return (int64_t)k;
        for (size_t i = 0; i < 6; ++i)
            velocity[6 * k + i] = state[i];
    }
    return -1;
}

void hd_replay(const hd_plant *plant, const hd_real *matrix, const hd_record *record,
               const int64_t *segments, size_t n_segments, const hd_real *attitude,
               hd_real max_step, hd_real limit, hd_real *velocity, int64_t *diverged_at,
               hd_real *work)
{
    hd_real inverse[36];
    driven moving = {plant, inverse, matrix, NULL, attitude ? 10 : 6, work};

    hd_mass_inverse(plant, inverse);
    for (size_t i = 0; i < 6 * record->n; ++i)
        velocity[i] = (hd_real)NAN;
    for (size_t s = 0; s < n_segments; ++s)
        diverged_at[s] = replay_segment(&moving, record, (size_t)segments[2 * s],
                                        (size_t)segments[2 * s + 1], attitude, max_step, limit,
                                        velocity);
}
