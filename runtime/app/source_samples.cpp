#include "runtime/app/source_samples.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
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
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kMaxNameBytes = 4096;
constexpr std::uint32_t kMaxNames = 1 << 20;
constexpr std::uint64_t kMaxSide = (std::uint64_t{1} << 30) + 1;  // samples along a side of the largest lattice
constexpr double kFarthestM = 1e9;                                // of a lattice
constexpr auto kPatience = std::chrono::milliseconds(5);          // between looks at the child

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

// Reads one layer's fields; `file` is the whole file, and `in` stands within it.
class LayerReader {
public:
    LayerReader(ByteReader& in, std::span<const std::uint8_t> file, std::string where)
        : in_(in), file_(file), where_(std::move(where)) {}

    Result<SourceLayer> read() {
        SourceLayer l;
        if (auto ok = read_names(l); !ok) return ok.error();
        const std::uint64_t columns = in_.u64(), rows = in_.u64(), step = in_.u64();
        const std::uint32_t sample_bytes = in_.u32();
        const std::uint64_t control_offset = in_.u64(), offset = in_.u64();
        if (!in_.ok()) return bad("the header is cut off");
        if (columns < 2 || rows < 2 || columns > kMaxSide || rows > kMaxSide)
            return bad(fmt::format("{} x {} samples; a side has 2 to {}", columns, rows, kMaxSide));
        if (step < 1 || step > 2 * kMaxSide)
            return bad(fmt::format("control points every {} samples; 1 to {} are sound", step, 2 * kMaxSide));
        if (sample_bytes != 4 && sample_bytes != 8)
            return bad(fmt::format("samples of {} bytes; 4 and 8 are known", sample_bytes));
        l.columns = static_cast<std::int64_t>(columns);
        l.rows = static_cast<std::int64_t>(rows);
        l.step = static_cast<std::int64_t>(step);
        l.sample_bytes = sample_bytes;
        // At most (2^30 + 1)^2 of either: no overflow in the counts.
        const auto points =
            static_cast<std::uint64_t>(l.control_columns()) * static_cast<std::uint64_t>(l.control_rows());
        auto controls = part(control_offset, points, 16, "control points");
        if (!controls) return controls.error();
        auto samples = part(offset, columns * rows, sample_bytes, "samples");
        if (!samples) return samples.error();
        l.controls = *controls;
        l.samples = *samples;
        if (auto ok = check_controls(l); !ok) return ok.error();
        return l;
    }

private:
    Error bad(const std::string& what) const { return {ErrorCode::input, where_ + ": " + what}; }

    Result<void> read_names(SourceLayer& l) {
        const std::uint32_t count = in_.u32();
        if (in_.ok() && (count == 0 || count > kMaxNames))
            return bad(fmt::format("a layer of {} files; 1 to {} are sound", count, kMaxNames));
        for (std::uint32_t k = 0; k < count && in_.ok(); ++k) {  // ends at the file's end, however large the count
            const std::uint32_t bytes = in_.u32();
            if (in_.ok() && bytes > kMaxNameBytes)
                return bad(fmt::format("a name of {} bytes; at most {} are sound", bytes, kMaxNameBytes));
            const auto name = in_.bytes(bytes);
            l.names.emplace_back(name.begin(), name.end());
        }
        return in_.ok() ? Result<void>() : bad("the header is cut off");
    }

    Result<std::span<const std::byte>> part(std::uint64_t offset, std::uint64_t count, std::uint64_t bytes_each,
                                            const char* what) const {
        const std::uint64_t size = file_.size();
        if (offset % 8 != 0) return bad(fmt::format("{} at byte {}, which is no multiple of 8", what, offset));
        if (offset < size - in_.remaining() || offset > size || count > (size - offset) / bytes_each)
            return bad(fmt::format("{} {} of {} bytes at byte {} do not lie within the file's {} bytes", count, what,
                                   bytes_each, offset, size));
        return std::as_bytes(file_.subspan(offset, count * bytes_each));
    }

    Result<void> check_controls(const SourceLayer& l) const {
        for (std::int64_t r = 0; r < l.control_rows(); ++r)
            for (std::int64_t c = 0; c < l.control_columns(); ++c) {
                const SourcePoint p = l.control(c, r);
                if (std::isnan(p.x) && std::isnan(p.y)) continue;
                if (!(std::abs(p.x) <= kFarthestM && std::abs(p.y) <= kFarthestM))
                    return bad(fmt::format("control point {}, {} at ({}, {}) m is no place within {} m", c, r, p.x, p.y,
                                           kFarthestM));
            }
        return {};
    }

    ByteReader& in_;
    std::span<const std::uint8_t> file_;
    std::string where_;
};

Result<std::vector<SourceLayer>> read_header(std::span<const std::uint8_t> file, const std::string& name) {
    ByteReader in(file);
    const auto magic = in.bytes(sizeof kMagic);
    const std::uint32_t version = in.u32(), count = in.u32();
    if (!in.ok() || std::memcmp(magic.data(), kMagic, sizeof kMagic) != 0)
        return Error{ErrorCode::input, fmt::format("{}: not a file of samples", name)};
    if (version != kVersion)
        return Error{ErrorCode::input,
                     fmt::format("{}: samples of version {}; this program reads version {}", name, version, kVersion)};
    if (count == 0) return Error{ErrorCode::input, fmt::format("{}: no layer in it", name)};
    std::vector<SourceLayer> layers;
    for (std::uint32_t k = 0; k < count; ++k) {  // ends at the file's end, however large the count
        auto layer = LayerReader(in, file, fmt::format("{}: layer {} of {}", name, k + 1, count)).read();
        if (!layer) return layer.error();
        layers.push_back(std::move(*layer));
    }
    return layers;
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
    if (!o.crs.empty()) words.push_back("--crs=" + o.crs);
    if (o.assume_crs) words.push_back("--assume-crs=" + *o.assume_crs);
    if (o.assume_same_datum)
        words.push_back("--assume-same-datum");
    else if (!o.vertical_crs.empty())
        words.push_back("--vertical-crs=" + o.vertical_crs);
    if (o.spacing_m) words.push_back(fmt::format("--spacing={}", *o.spacing_m));
    if (o.height_scale) words.push_back(fmt::format("--height-scale={}", *o.height_scale));
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

double SourceLayer::stored(std::int64_t column, std::int64_t row) const {
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
    return height;
}

double SourceLayer::at(std::int64_t column, std::int64_t row) const {
    const double height = stored(column, row);
    return std::isfinite(height) ? height * exaggeration : std::numeric_limits<double>::quiet_NaN();
}

bool SourceLayer::covered(std::int64_t column, std::int64_t row) const { return !std::isnan(stored(column, row)); }

SourcePoint SourceLayer::control(std::int64_t control_column, std::int64_t control_row) const {
    const std::int64_t k = control_row * control_columns() + control_column;
    SourcePoint p;
    std::memcpy(&p.x, controls.data() + k * 16, 8);
    std::memcpy(&p.y, controls.data() + k * 16 + 8, 8);
    return p;
}

SourcePoint SourceLayer::position(double column, double row) const {
    const auto cell_of = [this](double at, std::int64_t points) {
        return std::clamp<std::int64_t>(static_cast<std::int64_t>(at / static_cast<double>(step)), 0, points - 2);
    };
    const std::int64_t cc = cell_of(column, control_columns()), cr = cell_of(row, control_rows());
    const auto left = static_cast<double>(control_column(cc)), right = static_cast<double>(control_column(cc + 1));
    const auto top = static_cast<double>(control_row(cr)), bottom = static_cast<double>(control_row(cr + 1));
    const double s = (column - left) / (right - left), t = (row - top) / (bottom - top);
    const auto mix = [](const SourcePoint& a, const SourcePoint& b, double share) {
        return SourcePoint{(1 - share) * a.x + share * b.x, (1 - share) * a.y + share * b.y};
    };
    return mix(mix(control(cc, cr), control(cc + 1, cr), s), mix(control(cc, cr + 1), control(cc + 1, cr + 1), s), t);
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
    auto layers = read_header({static_cast<const std::uint8_t*>(start), size}, name);
    if (!layers) return layers.error();
    samples.layers_ = std::move(*layers);
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
