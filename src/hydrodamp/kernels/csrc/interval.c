/* Inputs between two samples: wrench and down interpolated, the rest held. */
#include "batch.h"

static const hd_real slack = (hd_real)1e-6; /* clocks round: 0.1 s is two steps of 0.05 s */

hd_interval hd_interval_after(const hd_record *record, size_t k, hd_real max_step)
{
    const hd_real length = record->time[k + 1] - record->time[k];
    const hd_real ratio = length / max_step * (1 - slack);
    const hd_interval interval = {
        length,
        ratio > 1 ? (size_t)hd_ceil(ratio) : 1,
        {record->wrench + 6 * k, record->wrench + 6 * (k + 1)},
        {record->down + 3 * k, record->down + 3 * (k + 1)},
        record->channels + record->n_channels * k,
        record->propulsion[2 * k],
    };

    return interval;
}

void hd_blend(const hd_real *a, const hd_real *b, hd_real fraction, size_t n, hd_real *out)
{
    for (size_t i = 0; i < n; ++i)
        out[i] = a[i] + fraction * (b[i] - a[i]);
}

int hd_diverged(const hd_real velocity[6], hd_real limit)
{
    for (size_t i = 0; i < 6; ++i)
        if (!(hd_fabs(velocity[i]) <= limit)) /* true for NaN as well */
            return 1;
    return 0;
}
