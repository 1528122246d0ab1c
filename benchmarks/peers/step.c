/* The step of all blocks in plain C, as one loop, for benchmarks/simulator_peers.py.

       cc -O3 -march=native -ffast-math -mprefer-vector-width=512 -o step step.c -lm
       step SIDE STEPS ROUNDS      prints block updates per second of processor time, the best of the rounds

   The model is that of docs/concepts/model.md on a flat sample with linearised springs: eight springs to neighbours,
   one to the slider, damping, individual thresholds of static and sliding friction, and the sums of motion and energy.
   Momenta are m v / dt; blocks beyond the edges never move. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define SPACING_M 5e-6
#define STIFFNESS_N_M (0.75 * 0.8e6 * SPACING_M)
#define MASS_KG (1012.0 * SPACING_M * SPACING_M * SPACING_M)
#define DAMPING_PER_S 5e5
#define DT_S 5e-8
#define SPEED_M_S 2e-4

typedef struct { double *x, *y; } Plane;

static double *zeros(size_t n) { return aligned_alloc(64, (n * sizeof(double) + 63) / 64 * 64); }

static double uniform(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

static void step(int side, int width, double pull, Plane q, Plane next, Plane p, const double *restrict holding,
                 const double *restrict sliding, double *restrict pace, double *restrict sums)
{
    const double keep = 1.0 - DAMPING_PER_S * DT_S, way = DT_S * DT_S / MASS_KG, quarter = 0.25 * STIFFNESS_N_M;
    const double *restrict qx = q.x, *restrict qy = q.y;
    double *restrict nx = next.x, *restrict ny = next.y, *restrict px = p.x, *restrict py = p.y;
    double along = 0.0, squares = 0.0, work = 0.0;
    for (int row = 1; row <= side; ++row) {
        for (int i = row * width + 8; i < row * width + 8 + side; ++i) {
            const int up = i - width, down = i + width;
            const double rise_x = qx[down + 1] + qx[up - 1], rise_y = qy[down + 1] + qy[up - 1];
            const double fall_x = qx[down - 1] + qx[up + 1], fall_y = qy[down - 1] + qy[up + 1];
            const double bent_x = 4.0 * (qx[i + 1] + qx[i - 1]) + rise_x + rise_y + fall_x - fall_y - 16.0 * qx[i];
            const double bent_y = 4.0 * (qy[up] + qy[down]) + rise_x + rise_y - fall_x + fall_y - 16.0 * qy[i];
            const double ax = keep * px[i] + quarter * bent_x + pull, ay = keep * py[i] + quarter * bent_y;
            const double drive = sqrt(ax * ax + ay * ay), was = pace[i];
            const double excess = drive - sliding[i], middle = was + excess;
            const int rests = was == 0.0, stops = was > 0.0 && excess <= 0.0;
            double part = (rests ? (drive > holding[i] ? 0.5 : 0.0) : 1.0) * (excess > 0.0 ? excess : 0.0);
            part = stops ? 0.125 * middle * middle / (was - excess) : part;
            const double share = part / (drive > 0.0 ? drive : 1.0);
            pace[i] = stops ? 0.0 : part;
            const double bx = share * ax, by = share * ay;
            nx[i] = qx[i] + way * bx;
            ny[i] = qy[i] + way * by;
            px[i] = stops ? 0.0 : bx;
            py[i] = stops ? 0.0 : by;
            along += bx;
            squares += part * part;
            work += part * sliding[i];
        }
    }
    sums[0] += along;
    sums[1] += squares;
    sums[2] += work;
}

int main(int argc, char **argv)
{
    if (argc != 4)
        return 2;
    const int side = atoi(argv[1]), steps = atoi(argv[2]), rounds = atoi(argv[3]);
    const int width = (side + 16 + 7) / 8 * 8;
    const size_t places = (size_t)width * (side + 2);
    double *all[9], sums[3] = {0.0, 0.0, 0.0}, best = 1e99;
    unsigned state = 1;
    for (int k = 0; k < 9; ++k) {
        all[k] = zeros(places);
        for (size_t i = 0; i < places; ++i)
            all[k][i] = 0.0;
    }
    for (size_t i = 0; i < places; ++i) {
        all[6][i] = 1e-6 * (1.0 + 0.1 * uniform(&state));
        all[7][i] = 0.6 * all[6][i];
    }
    Plane q = {all[0], all[1]}, next = {all[2], all[3]}, p = {all[4], all[5]};
    for (int round = 0; round < rounds; ++round) {
        const clock_t began = clock();
        for (int n = 0; n < steps; ++n) {
            step(side, width, STIFFNESS_N_M * SPEED_M_S * (1.6e-3 + (round * steps + n) * DT_S), q, next, p, all[6],
                 all[7], all[8], sums);
            const Plane old = q;
            q = next;
            next = old;
        }
        const double seconds = (double)(clock() - began) / CLOCKS_PER_SEC;
        best = seconds < best ? seconds : best;
    }
    fprintf(stderr, "sums %g %g %g\n", sums[0], sums[1], sums[2]);
    printf("%.6g\n", (double)side * side * steps / best);
    return 0;
}
