// Leaves with 77, which ctest reads as skipped, where the machine lacks what this program was built for: before main,
// as the tests that register themselves there are built for it too. Nothing here needs more than the least machine has.
#include <unistd.h>

#include <cstring>

namespace {

[[gnu::target("arch=x86-64"), gnu::constructor(101)]] void leave_without_needed_instructions() {
#ifdef __AVX2__
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
        __builtin_cpu_supports("bmi2"))
        return;
    static const char kMessage[] = "Skipped: this machine lacks the instructions of x86-64-v3 (AVX2, FMA, BMI2).\n";
    [[maybe_unused]] const auto written = ::write(STDOUT_FILENO, kMessage, sizeof kMessage - 1);
    ::_exit(77);
#endif
}

}  // namespace
