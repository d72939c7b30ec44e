// Runs a fuzz target on its seeds and on mutations of them. Run n of a generator seed is the same input everywhere, so
// a failure is repeated by --seed S --from n --runs 1.
//   --runs N      mutations (default 20000)
//   --seconds S   instead of a number of runs
//   --seed S|random, --from N
//   --write DIR   the seeds as files, for libFuzzer's corpus
//   FILE...       just these inputs
#include <unistd.h>
#include <csignal>

#include <algorithm>
#include <array>
#include <chrono>
#include <cinttypes>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string_view>

#include "tests/fuzz/fuzz_target.h"

extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*callback)());

namespace scree::fuzz {
namespace {

using Random = std::mt19937_64;

constexpr unsigned kHangSeconds = 60;
constexpr std::size_t kMaxBytes = std::size_t{1} << 16;

std::array<char, 96> g_repeat_by{};  // what the handler of a crash prints

void print_run() {
    const auto written = ::write(STDERR_FILENO, g_repeat_by.data(), std::strlen(g_repeat_by.data()));
    static_cast<void>(written);
}

void on_crash(int signal) {
    print_run();
    std::signal(signal, SIG_DFL);
    std::raise(signal == SIGALRM ? SIGABRT : signal);
}

std::size_t below(Random& random, std::size_t count) { return static_cast<std::size_t>(random() % count); }

std::string number(Random& random) {
    static constexpr std::array<const char*, 17> kNumbers = {"0",
                                                             "-1",
                                                             "1",
                                                             "2",
                                                             "65535",
                                                             "65536",
                                                             "2147483647",
                                                             "2147483648",
                                                             "-2147483649",
                                                             "9223372036854775807",
                                                             "1e308",
                                                             "1e-320",
                                                             "nan",
                                                             "-inf",
                                                             "1073741824",
                                                             "0.5",
                                                             ""};
    return kNumbers[below(random, kNumbers.size())];
}

// Numbers in text are what its parsers compute with.
void replace_number(Random& random, std::string& input) {
    const std::size_t start = input.find_first_of("0123456789", below(random, input.size()));
    if (start == std::string::npos) return;
    const std::size_t end = std::min(input.find_first_not_of("0123456789.eE+-", start), input.size());
    input.replace(start, end - start, number(random));
}

void mutate(Random& random, std::string& input, const std::vector<std::string>& seeds) {
    if (input.empty()) input = "x";
    const std::size_t at = below(random, input.size());
    const std::size_t length = 1 + below(random, std::min<std::size_t>(input.size() - at, 64));
    switch (below(random, 9)) {
        case 0:
            input[at] = static_cast<char>(input[at] ^ (1 << below(random, 8)));
            break;
        case 1:
            input[at] = static_cast<char>(random());
            break;
        case 2:
            for (std::size_t i = at; i < at + length; ++i) input[i] = (random() & 1) != 0 ? '\xFF' : '\0';
            break;
        case 3:
            input.resize(at);
            break;
        case 4:
            input.erase(at, length);
            break;
        case 5:
            input.insert(below(random, input.size()), input.substr(at, length));
            break;
        case 6: {
            const std::string& other = seeds[below(random, seeds.size())];
            if (!other.empty()) input = input.substr(0, at) + other.substr(below(random, other.size()));
            break;
        }
        default:
            replace_number(random, input);
            break;
    }
    if (input.size() > kMaxBytes) input.resize(kMaxBytes);
}

void run_one(const std::string& input) {
    ::alarm(kHangSeconds);
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

std::string read_file(const char* path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

struct Options {
    std::uint64_t runs = 20000, from = 0, seed = 1;
    double seconds = 0;
    std::string write_to;
    std::vector<const char*> files;
};

Options parse(int count, char** words) {
    Options o;
    for (int i = 1; i < count; ++i) {
        const std::string_view word = words[i];
        if (!word.starts_with("--") || i + 1 == count) {
            o.files.push_back(words[i]);
            continue;
        }
        const char* value = words[++i];
        if (word == "--runs") o.runs = std::strtoull(value, nullptr, 10);
        if (word == "--from") o.from = std::strtoull(value, nullptr, 10);
        if (word == "--seed")
            o.seed = value == std::string_view("random") ? std::random_device{}() : std::strtoull(value, nullptr, 10);
        if (word == "--seconds") o.seconds = std::strtod(value, nullptr);
        if (word == "--write") o.write_to = value;
    }
    return o;
}

void run_mutations(const Options& o, const std::vector<std::string>& from) {
    const auto start = std::chrono::steady_clock::now();
    const auto goes_on = [&](std::uint64_t done) {
        if (o.seconds == 0) return done < o.runs;
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < o.seconds;
    };
    std::uint64_t run = o.from;
    for (; goes_on(run - o.from); ++run) {
        std::snprintf(g_repeat_by.data(), g_repeat_by.size(),
                      "repeat by: --seed %" PRIu64 " --from %" PRIu64 " --runs 1\n", o.seed, run);
        Random random(o.seed * 0x9E3779B97F4A7C15u + run);
        std::string input = from[below(random, from.size())];
        for (std::size_t i = 1 + below(random, 6); i > 0; --i) mutate(random, input, from);
        run_one(input);
    }
    std::printf("%" PRIu64 " runs of seed %" PRIu64 "\n", run - o.from, o.seed);
}

int run(const Options& o) {
    const std::vector<std::string> from = seeds();
    require(!from.empty(), "a target has seeds");
    if (!o.write_to.empty()) {
        for (std::size_t i = 0; i < from.size(); ++i)
            std::ofstream(o.write_to + "/seed" + std::to_string(i), std::ios::binary) << from[i];
        return 0;
    }
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGALRM}) std::signal(signal, on_crash);
    if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(print_run);
    if (!o.files.empty()) {
        for (const char* file : o.files) run_one(read_file(file));
        return 0;
    }
    for (const std::string& seed : from) run_one(seed);
    run_mutations(o, from);
    return 0;
}

}  // namespace
}  // namespace scree::fuzz

int main(int count, char** words) { return scree::fuzz::run(scree::fuzz::parse(count, words)); }
