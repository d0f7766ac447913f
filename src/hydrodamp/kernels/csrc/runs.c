/* Estimators over whole records, and one step at a time on packed samples. */
#include "batch.h"

/* Position in a segment. A sample is evaluated once where the held inputs do not change. */
typedef struct {
    hd_end ends[2];
    hd_step step; /* the one to the last sample */
    hd_real *atoms;
    int is_reusable; /* whether ends[0] is valid for the next step */
} hd_cursor;

static void cursor_init(const hd_plant *plant, hd_cursor *cursor, hd_real *work)
{
    cursor->is_reusable = 0;
    cursor->atoms = work;
    cursor->ends[0].xi = work + hd_atom_count(plant->n_channels);
    cursor->ends[1].xi = cursor->ends[0].xi + plant->n_terms;
    cursor->step.xi = cursor->ends[1].xi + plant->n_terms;
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

/* Whether the held inputs are the same before and after `current`: then its terms need no second
 * evaluation. */
static int inputs_unchanged(const hd_plant *plant, const hd_sample *previous,
                            const hd_sample *current)
{
    for (size_t i = 0; i < plant->n_channels; ++i)
        if (!(previous->channels[i] == current->channels[i]))
            return 0;
    return current->closing == current->opening;
}

/* Take the step from sample k - 1 of a record to sample k. */
static void cursor_advance(const hd_plant *plant, const hd_record *record, size_t k,
                           hd_cursor *cursor)
{
    const hd_sample previous = sample_at(record, k - 1), current = sample_at(record, k);
    hd_end *first = &cursor->ends[0], *second = &cursor->ends[1];

    if (!cursor->is_reusable)
        hd_end_at(plant, &previous, previous.channels, previous.opening, cursor->atoms, first);
    hd_end_at(plant, &current, previous.channels, current.closing, cursor->atoms, second);
    hd_between(plant, first, second, current.length, &cursor->step);
    const hd_end swapped = *first;
    *first = *second;
    *second = swapped;
    cursor->is_reusable = inputs_unchanged(plant, &previous, &current);
}

static void store(const hd_history *history, size_t index, size_t n_terms, hd_real time,
                  const hd_real error[6], const hd_real *matrix)
{
    history->time[index] = time;
    for (size_t i = 0; i < 6; ++i)
        history->error[6 * index + i] = error[i];
    for (size_t i = 0; i < 6 * n_terms; ++i)
        history->matrix[6 * n_terms * index + i] = matrix[i];
}

void hd_adapt_run(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                  hd_real *matrix, hd_real error[6], const hd_record *record,
                  const int64_t *segments, size_t n_segments, size_t passes,
                  const hd_history *history, hd_real *work)
{
    size_t count = 0;
    hd_cursor cursor;

    for (size_t run = 0; run < passes * n_segments; ++run) {
        const size_t start = (size_t)segments[2 * (run % n_segments)];
        const size_t stop = (size_t)segments[2 * (run % n_segments) + 1];
        cursor_init(plant, &cursor, work);
        for (size_t i = 0; i < 6; ++i)
            error[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            cursor_advance(plant, record, k, &cursor);
            hd_adapt(plant, a, gamma, matrix, error, &cursor.step);
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
    hd_real *row = block + size, *workspace = row + plant->n_terms + 6;
    hd_cursor cursor;

    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        cursor_init(plant, &cursor, work);
        hd_iv_begin_segment(entries, estimate->iv);
        for (size_t i = 0; i < size; ++i)
            block[i] = 0;
        for (size_t k = start + 1; k < stop; ++k) {
            cursor_advance(plant, record, k, &cursor);
            if (hd_block_add(plant, entries->known, &cursor.step, length, block, row))
                hd_absorb(entries, estimate, plant->n_terms, row, workspace);
        }
    }
}

void hd_composite_run(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                      hd_real *state, const hd_record *record, const int64_t *segments,
                      size_t n_segments, hd_real *work)
{
    hd_real *workspace = work + hd_step_work(plant->n_terms, plant->n_channels);
    hd_cursor cursor;

    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        cursor_init(plant, &cursor, work);
        hd_composite_begin_segment(plant->n_terms, state);
        for (size_t k = start + 1; k < stop; ++k) {
            cursor_advance(plant, record, k, &cursor);
            hd_composite_step(plant, entries, law, &cursor.step, state, workspace);
        }
    }
}

int hd_online_step(const hd_online *online, const hd_real *previous, const hd_real *current,
                   hd_real *state, hd_real *work)
{
    const hd_plant *plant = online->plant;
    hd_real *row = work + hd_step_work(plant->n_terms, plant->n_channels);
    const hd_sample first = hd_unpacked(previous, 0);
    const hd_sample second = hd_unpacked(current, current[0] - previous[0]);
    hd_step step;

    if (!(second.length > 0))
        return 0;
    hd_step_between(plant, &first, &second, &step, work);
    if (online->law)
        return 1 + hd_composite_step(plant, online->entries, online->law, &step, state, row);
    if (online->known)
        return 1 + hd_block_add(plant, online->known, &step, online->length, state, row);
    hd_adapt(plant, online->a, online->gamma, state, state + 6 * plant->n_terms, &step);
    return 1;
}
