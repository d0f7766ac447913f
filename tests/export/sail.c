#include "auv_rich_3.h"
#include <stdio.h>
int main(void)
{
    hd_real state[auv_rich_3_STATES] = {(hd_real)1.5, 0, (hd_real)0.1, 0, 0, 0, 0, 0, 0, 1};
    const hd_real inputs[auv_rich_3_INPUTS] = {(hd_real)0.1, 1500, (hd_real)0.4, 2}, none[6] = {0};
    for (int k = 0; k < 100; ++k)
        auv_rich_3_step(state, inputs, none, (hd_real)0.05);
    for (size_t i = 0; i < sizeof state; ++i) /* no small printf has %a */
        printf("%02x", ((const unsigned char *)state)[i]);
    return 0;
}
