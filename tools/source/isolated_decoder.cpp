#include "tools/source/isolated_decoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <list>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "tools/source/decoder_protocol.h"

namespace scree {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::int64_t kSlowness = 10;
#else
constexpr std::int64_t kSlowness = 1;
#endif
// Idle processes that are kept: always so many, and more while they hold little.
constexpr std::size_t kAlwaysKept = 4;
constexpr std::size_t kMostKept = 16;
constexpr std::int64_t kKeptBytes = std::int64_t{64} << 20;

// What a decoder says on opening names its file; what became of the decoder does not.
constexpr const char* kDecoderFate = "its decoder ";

Error no_answer(const std::string& what) { return {ErrorCode::input, kDecoderFate + what}; }

Error about_file(const std::string& path, const Error& error) {
    if (!error.message.starts_with(kDecoderFate)) return error;
    return {error.code, fmt::format("{}: {} while opening it; the file is damaged or hostile", path, error.message)};
}

// --- accounts ---

class Accounts {
public:
    void set_server(std::size_t server, double cpu_seconds, std::int64_t rss_bytes) {
        const std::lock_guard lock(mutex_);
        servers_[server] = {cpu_seconds, rss_bytes};
        note_peak();
    }
    void add(double cpu_seconds, std::int64_t rss_bytes) {
        const std::lock_guard lock(mutex_);
        cpu_seconds_ += cpu_seconds;
        rss_bytes_ += rss_bytes;
        note_peak();
    }
    DecoderUsage usage() {
        const std::lock_guard lock(mutex_);
        return {cpu_seconds_ + servers_[0].cpu_seconds + servers_[1].cpu_seconds, peak_};
    }

private:
    void note_peak() { peak_ = std::max(peak_, rss_bytes_ + servers_[0].peak_rss_bytes + servers_[1].peak_rss_bytes); }

    std::mutex mutex_;
    std::array<DecoderUsage, 2> servers_;
    double cpu_seconds_ = 0;
    std::int64_t rss_bytes_ = 0, peak_ = 0;
};

Accounts& accounts() {
    static Accounts kept;
    return kept;
}

// --- servers ---

enum class Library : std::size_t { libtiff, openimageio };

const char* program_name(Library library) {
    return library == Library::libtiff ? "scree-decoder" : "scree-decoder-openimageio";
}

std::string find_program(const std::string& name) {
    std::error_code error;
    const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    std::vector<std::filesystem::path> folders;
    if (const char* folder = std::getenv("SCREE_DECODERS"); folder != nullptr) folders.emplace_back(folder);
    folders.push_back(here.parent_path() / "libexec" / "scree");
    folders.push_back(here);
#if defined(SCREE_DECODER_FOLDER)
    folders.emplace_back(SCREE_DECODER_FOLDER);  // builds with tests: their programs lie in other folders
#endif
    for (const auto& folder : folders)
        if (::access((folder / name).c_str(), X_OK) == 0) return folder / name;
    return {};
}

bool make_socket_pair(Descriptor& near_end, Descriptor& far_end) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return false;
    near_end = Descriptor(ends[0]);
    far_end = Descriptor(ends[1]);
    return true;
}

// Its own process group: an interrupt at the terminal is for the program, which then stops in order.
pid_t spawn_server(const std::string& program, int control) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
#if !defined(__SANITIZE_ADDRESS__)
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
#endif
    ::posix_spawn_file_actions_adddup2(&actions, control, kServerDescriptor);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, kServerDescriptor + 1);
    sigset_t all, none;
    ::sigfillset(&all);
    ::sigemptyset(&none);
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setpgroup(&attributes, 0);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
    std::string name = program;
    char* arguments[] = {name.data(), nullptr};
    pid_t process = -1;
    const int failure = ::posix_spawn(&process, program.c_str(), &actions, &attributes, arguments, environ);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failure == 0) return process;
    errno = failure;
    return -1;
}

class Server {
public:
    explicit Server(Library library) : library_(library) {}
    ~Server() { stop(); }

    /// The far end of a file's socket pair and the file's path, to a server that is started when it is not there.
    Result<void> request(const OpenRequest& request, const std::string& path, int descriptor) {
        const std::lock_guard lock(mutex_);
        if (control_.valid() && send_message(control_.get(), request, path, descriptor)) return {};
        stop();  // one that somebody killed is replaced
        if (Result<void> started = start(); !started) return started;
        if (send_message(control_.get(), request, path, descriptor)) return {};
        return Error{ErrorCode::io, fmt::format("{} ended as soon as it began", program_name(library_))};
    }

private:
    Result<void> start() {
        const std::string program = find_program(program_name(library_));
        if (program.empty())
            return Error{ErrorCode::io,
                         fmt::format("{} is not there, neither in ../libexec/scree nor beside this program; without it "
                                     "no image can be read: install it again",
                                     program_name(library_))};
        Descriptor far_end;
        if (!make_socket_pair(control_, far_end))
            return Error{ErrorCode::io, fmt::format("no socket for a decoder ({})", std::strerror(errno))};
        // dup2 onto itself would keep the mark that closes it.
        if (far_end.get() == kServerDescriptor)
            far_end = Descriptor(::fcntl(far_end.get(), F_DUPFD_CLOEXEC, kServerDescriptor + 1));
        process_ = spawn_server(program, far_end.get());
        if (process_ > 0) return {};
        control_ = Descriptor();
        return Error{ErrorCode::io, fmt::format("{} cannot be started ({})", program, std::strerror(errno))};
    }

    // It ends at once when its socket closes; waiting for that leaves nothing behind.
    void stop() {
        control_ = Descriptor();
        if (process_ > 0)
            while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
            }
        process_ = -1;
    }

    Library library_;
    std::mutex mutex_;
    Descriptor control_;
    pid_t process_ = -1;
};

Server& server_of(Library library) {
    (void)accounts();  // outlives the servers
    static Server libtiff(Library::libtiff);
    static Server openimageio(Library::openimageio);
    return library == Library::libtiff ? libtiff : openimageio;
}

// --- one process ---

// By its state in stat(5): R computes, which has a limit of its own; D is in a system call that waits for a disk or a
// file server, which is no fault of the file.
bool is_busy(pid_t process) {
    std::string text(512, '\0');
    const Descriptor file(::open(fmt::format("/proc/{}/stat", process).c_str(), O_RDONLY | O_CLOEXEC));
    const ssize_t bytes = file.valid() ? ::read(file.get(), text.data(), text.size()) : -1;
    if (bytes <= 0) return false;
    text.resize(static_cast<std::size_t>(bytes));
    const std::size_t name_end = text.rfind(')');
    return name_end != std::string::npos && name_end + 2 < text.size() &&
           (text[name_end + 2] == 'R' || text[name_end + 2] == 'D');
}

std::string describe_death(int status, std::int64_t cpu_seconds) {
    if (!WIFSIGNALED(status)) return "ended without an answer";
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU)
        return fmt::format("was stopped after {} s of processor time without an answer", cpu_seconds);
    const char* name = ::sigdescr_np(signal);
    return fmt::format("was killed by signal {}, {}", signal, name == nullptr ? "unknown" : name);
}

// Closing its socket kills the process.
class DecoderProcess {
public:
    DecoderProcess(Library library, Descriptor socket) : library_(library), socket_(std::move(socket)) {}
    ~DecoderProcess() {
        if (socket_.valid()) accounts().add(0, -rss_bytes_);
    }
    DecoderProcess(DecoderProcess&&) noexcept = default;
    DecoderProcess& operator=(DecoderProcess&&) = delete;

    static Result<DecoderProcess> start(Library library, const OpenRequest& request, const std::string& path) {
        Descriptor near_end, far_end;
        if (!make_socket_pair(near_end, far_end))
            return Error{ErrorCode::io, fmt::format("no socket for a decoder ({})", std::strerror(errno))};
        if (Result<void> asked = server_of(library).request(request, path, far_end.get()); !asked) return asked.error();
        return DecoderProcess(library, std::move(near_end));
    }

    Result<Answer> request_band(const BandRequest& request, int descriptor, std::int64_t wall_seconds) {
        // Where this fails there is a last word to be read.
        (void)send_message(socket_.get(), request, {}, descriptor);
        return answer(request.cpu_seconds, wall_seconds);
    }

    Result<Answer> answer(std::int64_t cpu_seconds, std::int64_t wall_seconds) {
        for (;;) {
            if (!wait(wall_seconds))
                return no_answer(fmt::format("gave no answer within {} s and was stopped", wall_seconds));
            auto message = receive_message<Answer>(socket_.get());
            if (!message && process_ == 0)
                return Error{ErrorCode::io, fmt::format("{} ended before it saw a file", program_name(library_))};
            if (!message) return no_answer("ended without an answer");
            const Answer& answer = message->head;
            switch (answer.kind) {
                case Answer::Kind::started:
                    process_ = answer.process;
                    continue;
                case Answer::Kind::died:
                    charge(answer.cpu_seconds, rss_bytes_);
                    return no_answer(describe_death(answer.wait_status, cpu_seconds));
                case Answer::Kind::error:
                case Answer::Kind::done:
                    break;
                default:
                    return no_answer("gave an answer that makes no sense");
            }
            charge(answer.cpu_seconds, answer.rss_bytes);
            if (answer.server_rss_bytes > 0)
                accounts().set_server(static_cast<std::size_t>(library_), answer.server_cpu_seconds,
                                      answer.server_rss_bytes);
            if (answer.kind == Answer::Kind::done) return answer;
            return Error{answer.code == static_cast<int>(ErrorCode::io) ? ErrorCode::io : ErrorCode::input,
                         message->text};
        }
    }

    std::int64_t rss_bytes() const { return rss_bytes_; }

private:
    bool wait(std::int64_t wall_seconds) const {
        pollfd polled{socket_.get(), POLLIN, 0};
        const int limit_ms = static_cast<int>(std::min<std::int64_t>(wall_seconds * 1000, 1 << 30));
        for (;;) {
            const int ready = ::poll(&polled, 1, limit_ms);
            if (ready > 0) return true;
            if (ready < 0 && errno != EINTR) return false;
            // A program that was stopped and goes on finds its time over and the answer there.
            if (ready == 0 && ::poll(&polled, 1, 0) <= 0 && !is_busy(process_)) return false;
        }
    }

    void charge(double cpu_seconds, std::int64_t rss_bytes) {
        accounts().add(cpu_seconds - cpu_seconds_, rss_bytes - rss_bytes_);
        cpu_seconds_ = cpu_seconds;
        rss_bytes_ = rss_bytes;
    }

    Library library_;
    Descriptor socket_;
    pid_t process_ = 0;
    double cpu_seconds_ = 0;
    std::int64_t rss_bytes_ = 0;
};

// Processes between two requests, oldest first. A program may hold thousands of files open; what it does not read from
// needs no process.
class IdleProcesses {
public:
    std::optional<DecoderProcess> take(const void* owner) {
        const std::lock_guard lock(mutex_);
        const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.owner == owner; });
        if (found == kept_.end()) return std::nullopt;
        bytes_ -= found->process.rss_bytes();
        std::optional<DecoderProcess> process(std::move(found->process));
        kept_.erase(found);
        return process;
    }

    void keep(const void* owner, DecoderProcess process) {
        const std::lock_guard lock(mutex_);
        bytes_ += process.rss_bytes();
        kept_.push_back({owner, std::move(process)});
        while (kept_.size() > kMostKept || (kept_.size() > kAlwaysKept && bytes_ > kKeptBytes)) {
            bytes_ -= kept_.front().process.rss_bytes();
            kept_.pop_front();
        }
    }

private:
    struct Kept {
        const void* owner;
        DecoderProcess process;
    };
    std::mutex mutex_;
    std::list<Kept> kept_;
    std::int64_t bytes_ = 0;
};

IdleProcesses& idle_processes() {
    (void)server_of(Library::libtiff);  // outlives the processes
    static IdleProcesses idle;
    return idle;
}

// --- the decoder ---

// Pages that a decoder process writes and this one reads. Its size is sealed: a decoder that cut it short would kill
// the reader.
class SharedBand {
public:
    SharedBand() = default;
    ~SharedBand() {
        if (begin_ != nullptr) ::munmap(begin_, static_cast<std::size_t>(bytes_));
    }
    SharedBand(SharedBand&& other) noexcept
        : descriptor_(std::move(other.descriptor_)),
          begin_(std::exchange(other.begin_, nullptr)),
          bytes_(std::exchange(other.bytes_, 0)) {}
    SharedBand& operator=(SharedBand&& other) noexcept {
        std::swap(descriptor_, other.descriptor_);
        std::swap(begin_, other.begin_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }

    static Result<SharedBand> make(std::int64_t bytes) {
        SharedBand band;
        band.descriptor_ = Descriptor(::memfd_create("scree-band", MFD_CLOEXEC | MFD_ALLOW_SEALING));
        void* at = MAP_FAILED;
        if (band.descriptor_.valid() && ::ftruncate(band.descriptor_.get(), bytes) == 0 &&
            ::fcntl(band.descriptor_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) == 0)
            at = ::mmap(nullptr, static_cast<std::size_t>(bytes), PROT_READ | PROT_WRITE, MAP_SHARED,
                        band.descriptor_.get(), 0);
        if (at == MAP_FAILED)
            return Error{ErrorCode::io,
                         fmt::format("no memory for a band of {} MiB ({})", bytes >> 20, std::strerror(errno))};
        band.begin_ = static_cast<std::byte*>(at);
        band.bytes_ = bytes;
        return band;
    }

    std::byte* begin() const { return begin_; }
    std::int64_t bytes() const { return bytes_; }
    const Descriptor& descriptor() const { return descriptor_; }
    /// The mapping stays; the other process has one of its own.
    void close_descriptor() { descriptor_ = Descriptor(); }

private:
    Descriptor descriptor_;
    std::byte* begin_ = nullptr;
    std::int64_t bytes_ = 0;
};

std::int64_t time_for(std::int64_t seconds, std::int64_t bytes, const DecoderLimits& limits) {
    return kSlowness * (seconds + bytes / limits.bytes_per_second);
}

class ProcessDecoder final : public BandDecoder {
public:
    ProcessDecoder(std::string path, const ImageHeader& header, const DecoderLimits& limits)
        : path_(std::move(path)), limits_(limits) {
        library_ = header.plain_tiff ? Library::libtiff : Library::openimageio;
        if (header.plain_tiff) directory_ = header.plain_tiff->directory;
        // Formats that cannot be read in parts are often decoded on opening.
        const bool whole = header.rows_per_strip >= header.height;
        opening_bytes_ = !whole ? 0 : header.height > 0 ? header.width * header.height * 4 : limits.memory_bytes / 4;
        if (limits.memory_bytes > 0) opening_bytes_ = std::min(opening_bytes_, limits.memory_bytes);
    }
    ~ProcessDecoder() override { (void)idle_processes().take(this); }

    Result<void> open() {
        Result<DecoderProcess> process = start();
        if (!process) return process.error();
        idle_processes().keep(this, std::move(*process));
        return {};
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<const std::byte*> decode(std::int64_t begin, std::int64_t end) override {
        std::optional<DecoderProcess> process = idle_processes().take(this);
        const bool fresh = !process;
        if (fresh) {
            if (Result<void> again = start_again(process); !again) return again.error();
        }
        const std::int64_t bytes =
            (end - begin) * layout_.width * layout_.channels * static_cast<std::int64_t>(memory_bytes(layout_.type));
        if (fresh || band_.bytes() < bytes) {
            band_ = SharedBand();  // the old one goes first
            Result<SharedBand> band = SharedBand::make(bytes);
            if (!band) return band.error();
            band_ = std::move(*band);
        }
        const BandRequest request{begin, end, bytes, band_.bytes(), time_for(limits_.cpu_seconds, bytes, limits_)};
        const Result<Answer> answer =
            process->request_band(request, band_.descriptor().get(), time_for(limits_.wall_seconds, bytes, limits_));
        band_.close_descriptor();
        // A process that failed is not asked again: the next rows, if any are wanted, get a new one.
        if (!answer) return answer.error();
        idle_processes().keep(this, std::move(*process));
        return static_cast<const std::byte*>(band_.begin());
    }

private:
    Result<DecoderProcess> start() {
        const OpenRequest request{false, directory_, limits_.memory_bytes,
                                  time_for(limits_.cpu_seconds, opening_bytes_, limits_)};
        Result<DecoderProcess> process = DecoderProcess::start(library_, request, path_);
        if (!process) return process.error();
        const Result<Answer> answer =
            process->answer(request.cpu_seconds, time_for(limits_.wall_seconds, opening_bytes_, limits_));
        if (!answer) return about_file(path_, answer.error());
        layout_ = answer->layout;
        return process;
    }

    // Its process was given up for others.
    Result<void> start_again(std::optional<DecoderProcess>& process) {
        const DecodedLayout before = layout_;
        Result<DecoderProcess> started = start();
        if (!started) return started.error();
        if (layout_.width != before.width || layout_.height != before.height || layout_.channels != before.channels ||
            layout_.type != before.type)
            return Error{ErrorCode::input, "its size or type changed while it was read"};
        process.emplace(std::move(*started));
        return {};
    }

    std::string path_;
    DecoderLimits limits_;
    Library library_ = Library::libtiff;
    std::uint64_t directory_ = 0;
    std::int64_t opening_bytes_ = 0;
    DecodedLayout layout_;
    SharedBand band_;
};

}  // namespace

Result<void> try_headers(const std::string& path, const DecoderLimits& limits) {
    const OpenRequest request{true, 0, limits.memory_bytes, time_for(limits.cpu_seconds, 0, limits)};
    Result<DecoderProcess> process = DecoderProcess::start(Library::libtiff, request, path);
    if (!process) return process.error();
    const Result<Answer> answer = process->answer(request.cpu_seconds, time_for(limits.wall_seconds, 0, limits));
    if (!answer) return about_file(path, answer.error());
    return {};
}

Result<std::unique_ptr<BandDecoder>> open_isolated_decoder(const std::string& path, const ImageHeader& header,
                                                           const DecoderLimits& limits) {
    auto decoder = std::make_unique<ProcessDecoder>(path, header, limits);
    if (Result<void> opened = decoder->open(); !opened) return opened.error();
    return std::unique_ptr<BandDecoder>(std::move(decoder));
}

DecoderUsage decoder_usage() { return accounts().usage(); }

}  // namespace scree
