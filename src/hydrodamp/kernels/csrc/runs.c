/* Estimators over whole records, and one step at a time on packed samples. */
#include "batch.h"

/* Along the samples of a segment, each evaluated once where nothing held changes. */
typedef struct {
    hd_end ends[2];
    hd_step step; /* the one to the last sample */
    hd_real *atoms;
    int fresh; /* whether ends[0] holds the last sample already */
} walk;

static void begin(const hd_plant *plant, walk *along, hd_real *work)
{
    along->fresh = 0;
    along->atoms = work;
    along->ends[0].xi = work + hd_atom_count(plant->n_channels);
    along->ends[1].xi = along->ends[0].xi + plant->n_terms;
    along->step.xi = along->ends[1].xi + plant->n_terms;
}

static hd_sample sample_at(const hd_record *record, size_t k)
{
    const hd_sample sample = {
        k ? record->time[k] - record->time[k - 1] : 0,
        record->velocity + 6 * k,
        record->down + 3 * k,
        record->wrench + 6 * k,
        record->channels + record->n_channels * k,
        record->propulsion[2 * k],
        record->propulsion[2 * k + 1],
    };

    return sample;
}

/* Whether the step after `current` holds what was held up to it, so that its values there
 * need no second evaluation. */
static int holds_on(const hd_plant *plant, const hd_sample *previous, const hd_sample *current)
{
    for (size_t i = 0; i < plant->n_channels; ++i)
        if (!(previous->channels[i] == current->channels[i]))
            return 0;
    return current->closing == current->opening;
}

/* Take the step from sample k - 1 to sample k. */
static void walk_to(const hd_plant *plant, const hd_record *record, size_t k, walk *along)
{
    const hd_sample previous = sample_at(record, k - 1), current = sample_at(record, k);
    hd_end *first = &along->ends[0], *second = &along->ends[1];

    if (!along->fresh)
        hd_end_at(plant, &previous, previous.channels, previous.opening, along->atoms, first);
    hd_end_at(plant, &current, previous.channels, current.closing, along->atoms, second);
    hd_between(plant, first, second, current.length, &along->step);
    const hd_end swapped = *first;
    *first = *second;
    *second = swapped;
    along->fresh = holds_on(plant, &previous, &current);
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

void hd_adapt_run(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                  hd_real *matrix, hd_real error[6], const hd_record *record,
                  const int64_t *segments, size_t n_segments, size_t passes,
                  const hd_history *history, hd_real *work)
{
    size_t count = 0;
    walk along;

    for (size_t run = 0; run < passes * n_segments; ++run) {
        const size_t start = (size_t)segments[2 * (run % n_segments)];
        const size_t stop = (size_t)segments[2 * (run % n_segments) + 1];
        begin(plant, &along, work);
        for (size_t i = 0; i < 6; ++i)
            error[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            walk_to(plant, record, k, &along);
            hd_adapt(plant, a, gamma, matrix, error, &along.step);
            ++count;
            if (history->every && count % history->every == 0)
                store(history, count / history->every - 1, plant->n_terms, record->time[k],
                      error, matrix);
        }
    }
}

size_t hd_recur_work(const hd_entries *entries, size_t n_terms, size_t n_channels)
{
    return hd_step_work(n_terms, n_channels) + hd_block_size(n_terms) + n_terms + 6 +
           hd_absorb_work(entries);
}

void hd_recur_run(const hd_plant *plant, const hd_entries *entries, const hd_estimate *estimate,
                  hd_real length, const hd_record *record, const int64_t *segments,
                  size_t n_segments, hd_real *work)
{
    const size_t size = hd_block_size(plant->n_terms);
    hd_real *block = work + hd_step_work(plant->n_terms, plant->n_channels);
    hd_real *row = block + size, *rest = row + plant->n_terms + 6;
    walk along;

    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        begin(plant, &along, work);
        for (size_t i = 0; i < size; ++i)
            block[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            walk_to(plant, record, k, &along);
            if (hd_block_add(plant, entries->known, &along.step, length, block, row))
                hd_absorb(entries, estimate, plant->n_terms, row, rest);
        }
    }
}

static hd_sample unpacked(const hd_real *values, hd_real length)
{
    const hd_sample sample = {
        length, values + 1, values + 7, values + 10, values + 18, values[16], values[17],
    };

    return sample;
}

/* The step between packed samples; 0 where time does not advance. */
static int step_packed(const hd_plant *plant, const hd_real *previous, const hd_real *current,
                       hd_step *step, hd_real *work)
{
    const hd_sample first = unpacked(previous, 0);
    const hd_sample second = unpacked(current, current[0] - previous[0]);

    if (!(second.length > 0))
        return 0;
    hd_step_between(plant, &first, &second, step, work);
    return 1;
}

int hd_adapt_packed(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                    hd_real *state, const hd_real *previous, const hd_real *current,
                    hd_real *work)
{
    hd_step step;

    if (!step_packed(plant, previous, current, &step, work))
        return 0;
    hd_adapt(plant, a, gamma, state, state + 6 * plant->n_terms, &step);
    return 1;
}

int hd_block_packed(const hd_plant *plant, const hd_real *known, hd_real length, hd_real *block,
                    const hd_real *previous, const hd_real *current, hd_real *work)
{
    hd_step step;

    if (!step_packed(plant, previous, current, &step, work + plant->n_terms + 6))
        return -1;
    return hd_block_add(plant, known, &step, length, block, work);
}
