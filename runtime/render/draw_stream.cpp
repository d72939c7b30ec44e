#include "runtime/render/draw_stream.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cassert>

namespace scree {

std::size_t DrawStream::attributes_offset(std::size_t region) const {
    return region * static_cast<std::size_t>(max_draws_) * sizeof(DrawAttributes);
}

std::size_t DrawStream::blends_offset(std::size_t region) const {
    return attributes_offset(kRegions) + region * static_cast<std::size_t>(max_draws_) * sizeof(BlendAttributes);
}

std::size_t DrawStream::commands_offset(std::size_t region) const {
    return blends_offset(kRegions) + region * static_cast<std::size_t>(max_commands_) * sizeof(DrawCommand);
}

Result<DrawStream> DrawStream::create(int max_draws, int more_commands) {
    assert(max_draws >= 1);
    DrawStream stream;
    stream.max_draws_ = max_draws;
    stream.max_commands_ = max_draws + more_commands;
    GLuint name = 0;
    glCreateBuffers(1, &name);
    stream.buffer_ = BufferHandle(name);
    constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    const auto bytes = static_cast<GLsizeiptr>(stream.commands_offset(kRegions));
    glNamedBufferStorage(name, bytes, nullptr, kAccess);
    stream.mapped_ = static_cast<std::byte*>(glMapNamedBufferRange(name, 0, bytes, kAccess));
    if (glGetError() != GL_NO_ERROR || stream.mapped_ == nullptr)
        return Error{ErrorCode::display, fmt::format("OpenGL cannot map {} bytes for {} draws", bytes, max_draws)};
    return stream;
}

DrawStream::~DrawStream() {
    for (const Fence& fence : in_use_)
        if (fence.sync != nullptr) glDeleteSync(fence.sync);
}

DrawStream::Region DrawStream::begin_frame() {
    current_ = (current_ + 1) % kRegions;
    if (Fence& fence = in_use_[current_]; fence.sync != nullptr) {
        constexpr GLuint64 kSecond_ns = 1'000'000'000;
        while (glClientWaitSync(fence.sync, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond_ns) == GL_TIMEOUT_EXPIRED) {
        }
        glDeleteSync(fence.sync);
        fence.sync = nullptr;
    }
    const auto draws = static_cast<std::size_t>(max_draws_);
    Region region;
    region.commands_offset = commands_offset(current_);
    region.attributes_offset = attributes_offset(current_);
    region.blends_offset = blends_offset(current_);
    region.commands = {reinterpret_cast<DrawCommand*>(mapped_ + region.commands_offset),
                       static_cast<std::size_t>(max_commands_)};
    region.attributes = {reinterpret_cast<DrawAttributes*>(mapped_ + region.attributes_offset), draws};
    region.blends = {reinterpret_cast<BlendAttributes*>(mapped_ + region.blends_offset), draws};
    return region;
}

void DrawStream::end_frame() { in_use_[current_].sync = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0); }

}  // namespace scree
