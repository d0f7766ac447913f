// The arrays of Python as the C99 core takes them. Every array is checked for shape here,
// because C cannot.
#ifndef HYDRODAMP_ARRAYS_HPP
#define HYDRODAMP_ARRAYS_HPP

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "hydrodamp.h"

namespace nb = nanobind;

static_assert(std::is_same_v<hd_real, double>, "the Python module is double precision");

template <typename T, nb::ssize_t... Shape>
using Array = nb::ndarray<T, nb::shape<Shape...>, nb::c_contig, nb::device::cpu>;

using Vector = Array<const double, -1>;
using Rows6 = Array<const double, -1, 6>;
using Vector6 = Array<const double, 6>;
using VectorOut = Array<double, 6>;
using RowsOut = Array<double, -1, 6>;
using Work = std::vector<double>;

inline void require(bool holds, const char *message)
{
    if (!holds)
        throw nb::value_error(message);
}

using Factors = Array<const int32_t, -1, 4>;
using Matrix6 = Array<const double, 6, 6>;
using Flags6 = Array<const bool, 6>;

// The arrays are kept with the pointers into them.
struct Plant {
    Factors factors;
    Matrix6 mass;
    Flags6 free_axes;
    hd_plant c;

    Plant(Factors factors_, Matrix6 mass_, Flags6 free_axes_, size_t n_channels)
        : factors(std::move(factors_)), mass(std::move(mass_)), free_axes(std::move(free_axes_)),
          c{factors.shape(0), n_channels, factors.data(), mass.data(),
            reinterpret_cast<const unsigned char *>(free_axes.data())}
    {
        const size_t n_atoms = hd_atom_count(n_channels);
        for (size_t i = 0; i < 4 * c.n_terms; ++i)
            require(c.factors[i] >= 0 && static_cast<size_t>(c.factors[i]) < n_atoms,
                    "a factor must be the number of an atom");
    }
    void fits(const Rows6 &matrix) const
    {
        require(matrix.shape(0) == c.n_terms, "a coefficient matrix must have one row a term");
    }
    Work work() const { return Work(hd_atom_count(c.n_channels) + c.n_terms); }
};

using Rows2 = Array<const double, -1, 2>;
using Rows3 = Array<const double, -1, 3>;
using Table = Array<const double, -1, -1>;

struct Record {
    Vector time;
    Rows6 velocity;
    Rows3 down;
    Rows6 wrench;
    Table channels;
    Rows2 propulsion;
    hd_record c;

    Record(Vector time_, Rows6 velocity_, Rows3 down_, Rows6 wrench_, Table channels_,
           Rows2 propulsion_)
        : time(std::move(time_)), velocity(std::move(velocity_)), down(std::move(down_)),
          wrench(std::move(wrench_)), channels(std::move(channels_)),
          propulsion(std::move(propulsion_)),
          c{time.shape(0), channels.shape(1), time.data(), velocity.data(),
            down.data(),   wrench.data(),     channels.data(), propulsion.data()}
    {
        require(velocity.shape(0) == c.n && down.shape(0) == c.n && wrench.shape(0) == c.n &&
                    channels.shape(0) == c.n && propulsion.shape(0) == c.n,
                "all arrays of a record must have one row a sample");
    }
};

using Segments = Array<const int64_t, -1, 2>;
using Rows4 = Array<const double, -1, 4>; // no rows: attitude as recorded in down

// Segments and attitude must lie inside the record, channels must be the plant's.
inline void check_run(const Plant &plant, const Record &record, const Segments &segments,
               size_t attitude_rows)
{
    require(plant.c.n_channels == record.c.n_channels, "plant and record differ in channels");
    require(attitude_rows == 0 || attitude_rows == record.c.n, "one quaternion a sample");
    for (size_t s = 0; s < segments.shape(0); ++s) {
        const int64_t start = segments.data()[2 * s], stop = segments.data()[2 * s + 1];
        require(0 <= start && start < stop && static_cast<size_t>(stop) <= record.c.n,
                "a segment must be a stretch of the record");
    }
}

// A packed sample: time, velocity, down, wrench, opening, closing, channels.
inline hd_sample unpacked(const double *values)
{
    return {values[0],   values + 1, values + 7, values + 10,
            values + 18, values[16], values[17]};
}

#endif
