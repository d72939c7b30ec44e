// GlHandle: owns one OpenGL object by its name (0: none) and deletes it when it goes. Only on the OpenGL thread, and
// before the context goes. No OpenGL header here, so that public headers can hold handles.
#pragma once

#include <cstdint>
#include <utility>

namespace scree {

template <void (*Delete)(std::uint32_t name)>
class GlHandle {
public:
    GlHandle() = default;
    explicit GlHandle(std::uint32_t name) : name_(name) {}
    GlHandle(GlHandle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    GlHandle& operator=(GlHandle&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    ~GlHandle() {
        if (name_ != 0) Delete(name_);
    }

    std::uint32_t name() const { return name_; }

private:
    std::uint32_t name_ = 0;
};

void delete_buffer(std::uint32_t name);
void delete_texture(std::uint32_t name);
void delete_vertex_array(std::uint32_t name);
void delete_framebuffer(std::uint32_t name);
void delete_renderbuffer(std::uint32_t name);
void delete_program(std::uint32_t name);
void delete_shader(std::uint32_t name);

using BufferHandle = GlHandle<delete_buffer>;
using TextureHandle = GlHandle<delete_texture>;
using VertexArrayHandle = GlHandle<delete_vertex_array>;
using FramebufferHandle = GlHandle<delete_framebuffer>;
using RenderbufferHandle = GlHandle<delete_renderbuffer>;
using ProgramHandle = GlHandle<delete_program>;
using ShaderHandle = GlHandle<delete_shader>;

}  // namespace scree
