#include "runtime/app/source_samples.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <thread>

#include "common/store/byte_io.h"

extern char** environ;

namespace scree {
namespace {

constexpr char kMagic[] = {'S', 'C', 'R', 'E', 'E', 'S', 'M', 'P'};
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kMaxNameBytes = 4096;
constexpr std::uint64_t kMaxSide = (std::uint64_t{1} << 30) + 1;  // samples along a side of the largest lattice
constexpr double kFarthestM = 1e9, kMinSpacingM = 1e-6, kMaxSpacingM = 1e6;  // those of a lattice
constexpr auto kPatience = std::chrono::milliseconds(5);                     // between looks at the child

class Descriptor {
public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return fd_; }

private:
    int fd_;
};

Error system_error(const std::string& what) {
    return {ErrorCode::io, fmt::format("{}: {}", what, std::strerror(errno))};
}

// Reads one source's fields; `file` is the whole file, and `in` stands within it.
Result<SourceRaster> read_raster(ByteReader& in, std::span<const std::uint8_t> file, const std::string& where) {
    const auto bad = [&](const std::string& what) { return Error{ErrorCode::input, where + ": " + what}; };
    const std::uint32_t name_bytes = in.u32();
    if (in.ok() && name_bytes > kMaxNameBytes)
        return bad(fmt::format("a name of {} bytes; at most {} are sound", name_bytes, kMaxNameBytes));
    const auto name = in.bytes(name_bytes);
    SourceRaster r;
    r.name.assign(name.begin(), name.end());
    for (double* v : {&r.x0, &r.y0, &r.dx, &r.dy}) *v = in.f64();
    const std::uint64_t columns = in.u64(), rows = in.u64();
    const std::uint32_t sample_bytes = in.u32();
    const std::uint64_t offset = in.u64();
    if (!in.ok()) return bad("the header is cut off");
    if (!(std::abs(r.x0) <= kFarthestM && std::abs(r.y0) <= kFarthestM))
        return bad(fmt::format("first sample at ({}, {}) m is no place within {} m", r.x0, r.y0, kFarthestM));
    for (const double spacing : {r.dx, r.dy})
        if (!(spacing >= kMinSpacingM && spacing <= kMaxSpacingM))
            return bad(fmt::format("spacing {} m is outside {}..{} m", spacing, kMinSpacingM, kMaxSpacingM));
    if (columns < 1 || rows < 1 || columns > kMaxSide || rows > kMaxSide)
        return bad(fmt::format("{} x {} samples; a side has 1 to {}", columns, rows, kMaxSide));
    if (sample_bytes != 4 && sample_bytes != 8)
        return bad(fmt::format("samples of {} bytes; 4 and 8 are known", sample_bytes));
    // At most (2^30 + 1)^2 * 8 < 2^64.
    const std::uint64_t bytes = columns * rows * sample_bytes, size = file.size();
    if (offset % 8 != 0) return bad(fmt::format("samples at byte {}, which is no multiple of 8", offset));
    if (offset < size - in.remaining() || offset > size || bytes > size - offset)
        return bad(
            fmt::format("samples at byte {}, {} bytes, do not lie within the file's {} bytes", offset, bytes, size));
    r.columns = static_cast<std::int64_t>(columns);
    r.rows = static_cast<std::int64_t>(rows);
    r.sample_bytes = sample_bytes;
    r.samples = std::as_bytes(file.subspan(offset, bytes));
    return r;
}

Result<std::vector<SourceRaster>> read_header(std::span<const std::uint8_t> file, const std::string& name) {
    ByteReader in(file);
    const auto magic = in.bytes(sizeof kMagic);
    const std::uint32_t version = in.u32(), count = in.u32();
    if (!in.ok() || std::memcmp(magic.data(), kMagic, sizeof kMagic) != 0)
        return Error{ErrorCode::input, fmt::format("{}: not a file of samples", name)};
    if (version != kVersion)
        return Error{ErrorCode::input,
                     fmt::format("{}: samples of version {}; this program reads version {}", name, version, kVersion)};
    if (count == 0) return Error{ErrorCode::input, fmt::format("{}: no source in it", name)};
    std::vector<SourceRaster> rasters;
    for (std::uint32_t k = 0; k < count; ++k) {  // ends at the file's end, however large the count
        auto raster = read_raster(in, file, fmt::format("{}: source {} of {}", name, k + 1, count));
        if (!raster) return raster.error();
        rasters.push_back(std::move(*raster));
    }
    return rasters;
}

std::string program_beside_this_one() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::string beside = (self.parent_path() / "scree").string();
    return !error && ::access(beside.c_str(), X_OK) == 0 ? beside : "scree";
}

Result<int> unnamed_file() {
    const char* chosen = std::getenv("TMPDIR");
    const std::string folder = chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
    int fd = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd >= 0) return fd;
    std::string name = folder + "/scree-samples.XXXXXX";  // not every file system has files without names
    fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return system_error(fmt::format("{}: cannot create a temporary file", folder));
    ::unlink(name.c_str());
    return fd;
}

std::vector<std::string> arguments_of(const std::vector<std::string>& sources, const SamplingOptions& o, int fd) {
    // With an equals sign: a value may begin with a minus. Formatted doubles read back as the same doubles.
    std::vector<std::string> words{"scree", "samples", "--quiet", fmt::format("--fd={}", fd)};
    if (o.spacing_m) words.push_back(fmt::format("--spacing={}", *o.spacing_m));
    words.push_back(fmt::format("--height-scale={}", o.height_scale));
    words.push_back(fmt::format("--height-offset={}", o.height_offset_m));
    if (o.nodata) words.push_back(fmt::format("--nodata={}", *o.nodata));
    words.push_back("--");
    words.insert(words.end(), sources.begin(), sources.end());
    return words;
}

Result<pid_t> spawn(const std::string& program, std::vector<std::string> words, int fd) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, fd, fd);  // onto itself: stays open in the child alone
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);  // our own output is a report
    pid_t child = -1;
    const int failure = ::posix_spawnp(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failure != 0)
        return Error{ErrorCode::io, fmt::format("{}: cannot be run to read the sources: {} (it is looked for beside "
                                                "this program, then on PATH)",
                                                program, std::strerror(failure))};
    return child;
}

// The child's status as waitpid gives it. It is asked to stop once, and then waited for: it removes nothing that others
// could see, but its messages should not come after our end.
Result<int> wait_for(pid_t child, const std::atomic<bool>* stop, const std::string& program) {
    bool asked = false;
    for (;;) {
        int status = 0;
        const pid_t ended = ::waitpid(child, &status, WNOHANG);
        if (ended == child) return status;
        if (ended < 0 && errno != EINTR) return system_error(program + ": cannot be waited for");
        if (!asked && stop != nullptr && stop->load()) {
            ::kill(child, SIGINT);
            asked = true;
        }
        std::this_thread::sleep_for(kPatience);
    }
}

Result<void> check_end(int status, const std::string& program) {
    const std::string who = fmt::format("{} samples", program);
    if (WIFSIGNALED(status)) return Error{ErrorCode::io, fmt::format("{}: killed by signal {}", who, WTERMSIG(status))};
    const int code = WEXITSTATUS(status);
    if (code == 0) return {};
    const bool known = (code >= static_cast<int>(ErrorCode::usage) && code <= static_cast<int>(ErrorCode::io)) ||
                       code == static_cast<int>(ErrorCode::interrupted);
    return Error{known ? static_cast<ErrorCode>(code) : ErrorCode::io,
                 fmt::format("{}: could not read the sources (exit code {})", who, code)};
}

}  // namespace

double SourceRaster::at(std::int64_t column, std::int64_t row) const {
    static_assert(std::endian::native == std::endian::little && std::numeric_limits<float>::is_iec559);
    assert(column >= 0 && column < columns && row >= 0 && row < rows);
    const std::byte* from = samples.data() + static_cast<std::size_t>(row * columns + column) * sample_bytes;
    double height = 0;
    if (sample_bytes == 8) {
        std::memcpy(&height, from, 8);
    } else {
        float narrow = 0;
        std::memcpy(&narrow, from, 4);
        height = narrow;
    }
    return std::isfinite(height) ? height : std::numeric_limits<double>::quiet_NaN();
}

Result<SourceSamples> SourceSamples::open(const std::string& path) {
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) return system_error(path);
    return map(file.get(), path);
}

Result<SourceSamples> SourceSamples::map(int descriptor, const std::string& name) {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) return system_error(name);
    if (!S_ISREG(status.st_mode) || status.st_size <= 0)
        return Error{ErrorCode::input, fmt::format("{}: not a file of samples", name)};
    const auto size = static_cast<std::size_t>(status.st_size);
    void* start = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
    if (start == MAP_FAILED) return system_error(name);
    SourceSamples samples;
    samples.mapping_ = {static_cast<const std::byte*>(start),
                        [start, size](const std::byte*) { ::munmap(start, size); }};
    auto rasters = read_header({static_cast<const std::uint8_t*>(start), size}, name);
    if (!rasters) return rasters.error();
    samples.rasters_ = std::move(*rasters);
    return samples;
}

Result<SourceSamples> sample_sources(const std::vector<std::string>& sources, const SamplingOptions& options) {
    auto fd = unnamed_file();
    if (!fd) return fd.error();
    const Descriptor file(*fd);
    const std::string program = options.program.empty() ? program_beside_this_one() : options.program;
    const auto child = spawn(program, arguments_of(sources, options, file.get()), file.get());
    if (!child) return child.error();
    const auto status = wait_for(*child, options.stop, program);
    if (!status) return status.error();
    if (options.stop != nullptr && options.stop->load()) return Error{ErrorCode::interrupted, "stopped"};
    if (auto ok = check_end(*status, program); !ok) return ok.error();
    return SourceSamples::map(file.get(), fmt::format("what {} samples wrote", program));
}

}  // namespace scree
