// What a program and its decoder processes say to each other (docs/decisions/0009-decoders-run-apart.md): packets over
// local sockets between binaries of one build, so structs travel as they lie in memory. What comes from a decoder is
// checked like what comes from a file.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "tools/source/pixel_decoder.h"

namespace scree {

/// The descriptor at which a decoder program finds the socket of the program that started it.
inline constexpr int kServerDescriptor = 3;

/// A descriptor, closed with its owner.
class Descriptor {
public:
    Descriptor() = default;
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept;
    Descriptor& operator=(Descriptor&& other) noexcept;

    int get() const { return descriptor_; }
    bool valid() const { return descriptor_ >= 0; }
    int release();

private:
    int descriptor_ = -1;
};

/// Program to server, with the file's path as text and the decoder's end of a socket pair as descriptor: make a process
/// for this file. All that follows goes over that socket pair.
struct OpenRequest {
    bool headers_only = false;      ///< parse headers and georeference and say whether that went well
    std::uint64_t directory = 0;    ///< of a TIFF's mask, as PlainTiff has it; 0: the image
    std::int64_t memory_bytes = 0;  ///< that the process may add to what it has when it begins; 0: no limit
    std::int64_t cpu_seconds = 0;   ///< for the opening
};

/// Program to decoder; comes with a descriptor where the shared memory is a new one.
struct BandRequest {
    std::int64_t begin = 0, end = 0;  ///< rows
    std::int64_t bytes = 0;           ///< of the band; the shared memory has no fewer
    std::int64_t shared_bytes = 0;    ///< size of the shared memory
    std::int64_t cpu_seconds = 0;
};

/// Decoder to program, with the message as text where the outcome is an error.
struct Answer {
    enum class Kind : std::int32_t {
        started,  ///< from the server: the process exists
        done,
        error,
        died  ///< from the server: what wait() said of the process
    };
    Kind kind = Kind::error;
    std::int32_t code = 0;         ///< error: an ErrorCode
    std::int32_t wait_status = 0;  ///< died
    pid_t process = 0;             ///< started
    DecodedLayout layout;          ///< done, after opening
    double cpu_seconds = 0;        ///< of the process so far
    std::int64_t rss_bytes = 0;    ///< peak, beyond what it had when it began
    double server_cpu_seconds = 0;
    std::int64_t server_rss_bytes = 0;  ///< peak
};

/// Longer texts are cut.
inline constexpr std::size_t kMaxPacketText = 8192;

struct Packet {
    std::string bytes;
    Descriptor descriptor;
};

/// False where the other side is gone. Neither raises a signal.
bool send_packet(int socket, std::string_view bytes, int descriptor = -1);
/// Waits for one; nullopt where the other side is gone or what came makes no sense.
std::optional<Packet> receive_packet(int socket);

template <class Head>
bool send_message(int socket, const Head& head, std::string_view text = {}, int descriptor = -1) {
    static_assert(std::is_trivially_copyable_v<Head>);
    std::string bytes(reinterpret_cast<const char*>(&head), sizeof head);
    bytes.append(text.substr(0, kMaxPacketText));
    return send_packet(socket, bytes, descriptor);
}

template <class Head>
struct Message {
    Head head;
    std::string text;
    Descriptor descriptor;
};

template <class Head>
std::optional<Message<Head>> receive_message(int socket) {
    static_assert(std::is_trivially_copyable_v<Head>);
    std::optional<Packet> packet = receive_packet(socket);
    if (!packet || packet->bytes.size() < sizeof(Head)) return std::nullopt;
    Message<Head> message;
    std::memcpy(&message.head, packet->bytes.data(), sizeof(Head));
    message.text = packet->bytes.substr(sizeof(Head));
    message.descriptor = std::move(packet->descriptor);
    return message;
}

}  // namespace scree
