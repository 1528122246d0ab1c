// Steps of FrictionQPotSpringBlock's Line2d.System_Cuspy_Laplace, for benchmarks/simulator_peers.py.
//
//     frictionqpot SIDE STEPS ROUNDS     prints block updates per second of processor time, the best of the rounds
#define PRRNG_USE_BOOST 0
#include <xtensor/xtensor.hpp>

#include <prrng.h>

#include <FrictionQPotSpringBlock/Line2d.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

int main(int argc, char** argv)
{
    if (argc != 4) {
        return 2;
    }
    const size_t side = std::atoi(argv[1]), steps = std::atoi(argv[2]), rounds = std::atoi(argv[3]);
    FrictionQPotSpringBlock::Line2d::System_Cuspy_Laplace system(
        1.0, 0.1, 1.0, 1.0, 0.1, 0.1, {side, side}, 0, "random", {1.0, 0.5}, -50.0, 200
    );
    double best = 1e99;
    for (size_t round = 0; round < rounds; ++round) {
        const std::clock_t began = std::clock();
        for (size_t k = 0; k < 10; ++k) {
            system.set_u_frame(0.1 * static_cast<double>(10 * round + k));
            system.timeSteps(steps / 10);
        }
        best = std::min(best, static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
    }
    std::printf("%.6g\n", static_cast<double>(side * side * (steps / 10) * 10) / best);
    return 0;
}
