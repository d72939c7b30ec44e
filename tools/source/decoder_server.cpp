#include "tools/source/decoder_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <map>
#include <new>
#include <utility>
#include <vector>

#include "tools/source/decoder_protocol.h"
#include "tools/source/georeference.h"
#include "tools/source/image_header.h"

namespace scree {
namespace {

constexpr rlim_t kStackBytes =
    rlim_t{8} << 20;  // what a shell gives; where there is no limit, endless recursion eats all

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kSanitized = true;  // its shadow memory counts as data
#else
constexpr bool kSanitized = false;
#endif

double seconds_of(const rusage& usage) {
    return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

rusage usage_of(int who) {
    rusage usage{};
    ::getrusage(who, &usage);
    return usage;
}

std::int64_t rss_of(const rusage& usage) { return std::int64_t{usage.ru_maxrss} * 1024; }

// Bytes of private writable memory, which is what RLIMIT_DATA counts (proc(5), statm: the sixth number).
std::int64_t data_bytes() {
    long long pages = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "r"); file != nullptr) {
        if (std::fscanf(file, "%*s %*s %*s %*s %*s %lld", &pages) != 1) pages = 0;
        std::fclose(file);
    }
    return pages * ::sysconf(_SC_PAGESIZE);
}

void set_soft_limit(__rlimit_resource resource, rlim_t value) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) != 0) return;
    limit.rlim_cur = std::min(limit.rlim_max, value);
    ::setrlimit(resource, &limit);
}

// The limit counts whole seconds of the process's life.
void allow_cpu_seconds(std::int64_t seconds) {
    const auto used = static_cast<std::int64_t>(seconds_of(usage_of(RUSAGE_SELF)));
    set_soft_limit(RLIMIT_CPU, static_cast<rlim_t>(used + 1 + seconds));
}

// Decoders quote what they find in files.
std::string one_line(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

class SharedMemory {
public:
    ~SharedMemory() { unmap(); }

    bool map(const Descriptor& descriptor, std::int64_t bytes) {
        unmap();
        void* at =
            ::mmap(nullptr, static_cast<std::size_t>(bytes), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor.get(), 0);
        if (at == MAP_FAILED) return false;
        begin_ = static_cast<std::byte*>(at);
        bytes_ = bytes;
        return true;
    }
    std::byte* begin() const { return begin_; }
    std::int64_t bytes() const { return bytes_; }

private:
    void unmap() {
        if (begin_ != nullptr) ::munmap(begin_, static_cast<std::size_t>(bytes_));
        begin_ = nullptr;
    }

    std::byte* begin_ = nullptr;
    std::int64_t bytes_ = 0;
};

// One process, one file.
class FileServer {
public:
    FileServer(const DecoderProgram& program, int socket, const rusage& server, OpenRequest request, std::string path)
        : program_(program), socket_(socket), server_(server), request_(request), path_(std::move(path)) {}

    [[noreturn]] void run() {
        limit();
        first_rss_ = rss_of(usage_of(RUSAGE_SELF));
        if (Result<void> opened = guarded([&] { return open(); }); !opened) {
            answer(opened.error());
            ::_exit(0);
        }
        Answer ready = done();
        if (decoder_) ready.layout = decoder_->layout();
        bool alive = send_message(socket_, ready);
        while (alive && decoder_) {
            auto request = receive_message<BandRequest>(socket_);
            if (!request) break;
            const Result<void> decoded = guarded([&] { return decode(*request); });
            alive = decoded ? send_message(socket_, done()) : answer(decoded.error());
        }
        ::_exit(0);
    }

private:
    void limit() const {
        set_soft_limit(RLIMIT_CORE, 0);
        // A handler of cores that is a pipe does not heed RLIMIT_CORE.
        if (!kSanitized) ::prctl(PR_SET_DUMPABLE, 0);
        set_soft_limit(RLIMIT_STACK, kStackBytes);
        allow_cpu_seconds(request_.cpu_seconds);
        if (request_.memory_bytes > 0 && !kSanitized)
            set_soft_limit(RLIMIT_DATA, static_cast<rlim_t>(data_bytes() + request_.memory_bytes));
    }

    Result<void> open() {
        Result<ImageHeader> header = read_image_header(path_);
        if (!header) return header.error();
        if (request_.headers_only) {
            // What they say is the caller's to find out; here they only must come back.
            (void)read_mask_header(path_, *header);
            (void)read_georeference(path_);
            return {};
        }
        if (request_.directory != 0) {
            Result<std::optional<ImageHeader>> mask = read_mask_header(path_, *header);
            if (!mask) return mask.error();
            if (!*mask || (*mask)->plain_tiff->directory != request_.directory)
                return Error{ErrorCode::input, path_ + ": its mask changed while it was read"};
            *header = std::move(**mask);
        }
        Result<std::unique_ptr<PixelDecoder>> decoder = program_.open(path_, *header);
        if (!decoder) return decoder.error();
        decoder_ = std::move(*decoder);
        return {};
    }

    Result<void> decode(const Message<BandRequest>& request) {
        const BandRequest& band = request.head;
        allow_cpu_seconds(band.cpu_seconds);
        if (request.descriptor.valid() && !shared_.map(request.descriptor, band.shared_bytes))
            return Error{ErrorCode::io, "no address space for the memory that is shared"};
        const DecodedLayout& layout = decoder_->layout();
        std::int64_t needed = 0;
        if (band.begin < 0 || band.begin >= band.end || band.end > layout.height ||
            __builtin_mul_overflow((band.end - band.begin) * layout.channels, layout.width, &needed) ||
            __builtin_mul_overflow(needed, static_cast<std::int64_t>(memory_bytes(layout.type)), &needed) ||
            needed != band.bytes || needed > shared_.bytes())
            return Error{ErrorCode::io, "a request for a band that does not fit the file"};
        return decoder_->decode(band.begin, band.end, shared_.begin());
    }

    template <class Call>
    Result<void> guarded(Call&& call) const {
        try {
            return call();
        } catch (const std::bad_alloc&) {
            return Error{ErrorCode::input,
                         request_.memory_bytes > 0
                             ? fmt::format("its decoder needs more memory than the {} MiB it may have; give more with "
                                           "--memory if the file is sound",
                                           request_.memory_bytes >> 20)
                             : std::string("its decoder ran out of memory")};
        } catch (const std::exception& problem) {
            return Error{ErrorCode::input, problem.what()};
        }
    }

    // The band is shared with the program, which counts it.
    Answer done() {
        Answer answer;
        const rusage usage = usage_of(RUSAGE_SELF);
        own_rss_ = std::max(own_rss_, rss_of(usage) - first_rss_ - shared_.bytes());
        answer.kind = Answer::Kind::done;
        answer.cpu_seconds = seconds_of(usage);
        answer.rss_bytes = own_rss_;
        answer.server_cpu_seconds = seconds_of(server_);
        answer.server_rss_bytes = rss_of(server_);
        return answer;
    }

    bool answer(const Error& error) {
        Answer answer = done();
        answer.kind = Answer::Kind::error;
        answer.code = static_cast<std::int32_t>(error.code);
        return send_message(socket_, answer, one_line(error.message));
    }

    const DecoderProgram& program_;
    int socket_;
    rusage server_;
    OpenRequest request_;
    std::string path_;
    std::int64_t first_rss_ = 0, own_rss_ = 0;
    std::unique_ptr<PixelDecoder> decoder_;
    SharedMemory shared_;
};

class Server {
public:
    Server(const DecoderProgram& program, int child_ended) : program_(program), child_ended_(child_ended) {}

    int run() {
        for (;;) {
            std::vector<pollfd> polled{{kServerDescriptor, POLLIN, 0}, {child_ended_, POLLIN, 0}};
            std::vector<pid_t> processes;
            // No events: a packet on these is the process's to read, but the end of its reader is ours to see.
            for (const auto& [process, socket] : sockets_) {
                polled.push_back({socket.get(), 0, 0});
                processes.push_back(process);
            }
            if (::poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) return 1;
            for (std::size_t i = 0; i < processes.size(); ++i)
                if ((polled[i + 2].revents & (POLLHUP | POLLERR)) != 0) ::kill(processes[i], SIGKILL);
            if (polled[1].revents != 0) reap();
            if (polled[0].revents != 0 && !start()) {
                end_all();
                return 0;
            }
        }
    }

private:
    bool start() {
        auto request = receive_message<OpenRequest>(kServerDescriptor);
        if (!request || !request->descriptor.valid()) return false;
        const rusage before = usage_of(RUSAGE_SELF);
        const pid_t server = ::getpid();
        const pid_t process = ::fork();
        if (process == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            if (::getppid() != server) ::_exit(0);
            become_file_server(*request, before);
        }
        Answer answer;
        answer.kind = process > 0 ? Answer::Kind::started : Answer::Kind::error;
        answer.code = static_cast<std::int32_t>(ErrorCode::io);
        answer.process = process;
        (void)send_message(request->descriptor.get(), answer, "no process could be made for its decoder");
        if (process > 0) sockets_.emplace(process, std::move(request->descriptor));
        return true;
    }

    [[noreturn]] void become_file_server(const Message<OpenRequest>& request, const rusage& server) {
        // Another file's socket that stayed open here would keep its decoder alive.
        sockets_.clear();
        ::close(kServerDescriptor);
        ::close(child_ended_);
        sigset_t none;
        ::sigemptyset(&none);
        ::sigprocmask(SIG_SETMASK, &none, nullptr);
        FileServer(program_, request.descriptor.get(), server, request.head, request.text).run();
    }

    void reap() {
        signalfd_siginfo information{};
        while (::read(child_ended_, &information, sizeof information) > 0) {
        }
        int status = 0;
        rusage usage{};
        for (pid_t process = 0; (process = ::wait4(-1, &status, WNOHANG, &usage)) > 0;) {
            const auto found = sockets_.find(process);
            if (found == sockets_.end()) continue;
            Answer answer;
            answer.kind = Answer::Kind::died;
            answer.wait_status = status;
            answer.cpu_seconds = seconds_of(usage);
            (void)send_message(found->second.get(), answer);
            sockets_.erase(found);
        }
    }

    // Whoever inherits a dead process from us may not be one that clears it away.
    void end_all() {
        for (const auto& [process, socket] : sockets_) ::kill(process, SIGKILL);
        while (::wait4(-1, nullptr, 0, nullptr) > 0) {
        }
    }

    const DecoderProgram& program_;
    int child_ended_;
    std::map<pid_t, Descriptor> sockets_;
};

}  // namespace

int serve_decoders(const DecoderProgram& program) {
    int type = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(kServerDescriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_SEQPACKET) {
        std::fputs("This is a part of scree, which starts it by itself to decode images.\n", stderr);
        return static_cast<int>(ErrorCode::usage);
    }
    sigset_t ends;
    ::sigemptyset(&ends);
    ::sigaddset(&ends, SIGCHLD);
    ::sigprocmask(SIG_BLOCK, &ends, nullptr);
    const int child_ended = ::signalfd(-1, &ends, SFD_NONBLOCK | SFD_CLOEXEC);
    if (child_ended < 0) return static_cast<int>(ErrorCode::io);
    program.prepare();
    return Server(program, child_ended).run();
}

}  // namespace scree
