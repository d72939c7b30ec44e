#include "runtime/render/texture_arena.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace scree {
namespace {

constexpr GLenum kFormat = GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;

}  // namespace

Result<TextureArena> TextureArena::create(const TextureArenaOptions& options) {
    assert(options.slots >= 1 && options.anisotropy >= 1);
    assert(options.max_array_layers >= 1 && options.max_array_layers <= kMaxArrayLayers);
    GLint driver_layers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &driver_layers);
    float anisotropy = 1;
    if (epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic")) {
        glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &anisotropy);
        anisotropy = std::min(anisotropy, static_cast<float>(options.anisotropy));
    }

    TextureArena arena;
    arena.texture_size_log2_ = options.texture_size_log2;
    arena.slots_ = options.slots;
    arena.layers_per_array_ = std::min({options.max_array_layers, static_cast<int>(driver_layers), options.slots});
    const GLsizei size = 1 << options.texture_size_log2;
    for (int first = 0; first < options.slots; first += arena.layers_per_array_) {
        GLuint name = 0;
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
        arena.arrays_.emplace_back(name);
        glTextureStorage3D(name, mip_count(options.texture_size_log2), kFormat, size, size,
                           std::min(arena.layers_per_array_, options.slots - first));
        glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        if (anisotropy > 1) glTextureParameterf(name, GL_TEXTURE_MAX_ANISOTROPY_EXT, anisotropy);
        if (glGetError() != GL_NO_ERROR)
            return Error{ErrorCode::display,
                         fmt::format("OpenGL has no {} bytes for {} texture slots; lower the memory budget",
                                     texture_arena_bytes(options.texture_size_log2, options.slots), options.slots)};
    }
    return arena;
}

void TextureArena::upload(int slot, std::span<const std::uint8_t> chain) {
    assert(slot >= 0 && slot < slots_ && chain.size() == bc1_chain_bytes(texture_size_log2_));
    const GLuint array = arrays_[static_cast<std::size_t>(array_of(slot))].name();
    for (int mip = 0; mip <= texture_size_log2_; ++mip) {
        const GLsizei size = 1 << (texture_size_log2_ - mip);
        const auto bytes =
            chain.subspan(bc1_mip_offset(texture_size_log2_, mip), bc1_mip_bytes(texture_size_log2_, mip));
        glCompressedTextureSubImage3D(array, mip, 0, 0, layer_of(slot), size, size, 1, kFormat,
                                      static_cast<GLsizei>(bytes.size()), bytes.data());
    }
}

}  // namespace scree
