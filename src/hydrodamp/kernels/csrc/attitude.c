/* Attitude as a quaternion q = (w, x, y, z), body to world. */
#include "batch.h"

static const hd_real half = (hd_real)0.5;

void hd_down(const hd_real q[4], hd_real down[3])
{
    const hd_real w = q[0], x = q[1], y = q[2], z = q[3];

    down[0] = 2 * (x * z - w * y);
    down[1] = 2 * (y * z + w * x);
    down[2] = w * w - x * x - y * y + z * z;
}

void hd_down_slope(const hd_real q[4], hd_real slope[12])
{
    const hd_real w = 2 * q[0], x = 2 * q[1], y = 2 * q[2], z = 2 * q[3];
    const hd_real rows[12] = {-y, z, -w, x, x, w, z, y, w, -x, -y, z};

    for (size_t i = 0; i < 12; ++i)
        slope[i] = rows[i];
}

void hd_quaternion_rate(const hd_real q[4], const hd_real omega[3], hd_real rate[4])
{
    hd_real slope[12];

    hd_quaternion_by_omega(q, slope); /* dq/dt = 1/2 q (0, omega) is linear in omega */
    for (size_t i = 0; i < 4; ++i)
        rate[i] = slope[3 * i] * omega[0] + slope[3 * i + 1] * omega[1] +
                  slope[3 * i + 2] * omega[2];
}

void hd_quaternion_by_omega(const hd_real q[4], hd_real slope[12])
{
    const hd_real w = half * q[0], x = half * q[1], y = half * q[2], z = half * q[3];
    const hd_real rows[12] = {-x, -y, -z, w, -z, y, z, w, -x, -y, x, w};

    for (size_t i = 0; i < 12; ++i)
        slope[i] = rows[i];
}

void hd_quaternion_by_itself(const hd_real omega[3], hd_real slope[16])
{
    const hd_real p = half * omega[0], q = half * omega[1], r = half * omega[2];
    const hd_real rows[16] = {0, -p, -q, -r, p, 0, r, -q, q, -r, 0, p, r, q, -p, 0};

    for (size_t i = 0; i < 16; ++i)
        slope[i] = rows[i];
}

hd_real hd_normalise(hd_real q[4])
{
    const hd_real length = hd_sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);

    for (size_t i = 0; i < 4; ++i)
        q[i] /= length;
    return length;
}
