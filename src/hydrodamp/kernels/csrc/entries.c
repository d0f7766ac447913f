/* Coefficients listed axis by axis: what a method moves, apart from what is known. */
#include "onboard.h"

size_t hd_entries_on(const hd_entries *entries, size_t axis)
{
    return (size_t)(entries->starts[axis + 1] - entries->starts[axis]);
}

size_t hd_entries_squares(const hd_entries *entries)
{
    size_t total = 0;

    for (size_t i = 0; i < 6; ++i)
        total += hd_entries_on(entries, i) * hd_entries_on(entries, i);
    return total;
}

void hd_known_force(const hd_entries *entries, const hd_real *xi, size_t n_terms,
                    hd_real force[6])
{
    for (size_t i = 0; i < 6; ++i)
        force[i] = 0;
    for (size_t j = 0; j < n_terms; ++j)
        for (size_t i = 0; i < 6; ++i)
            force[i] += entries->known[6 * j + i] * xi[j];
}
