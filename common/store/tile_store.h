// TileStore: where tiles are read from. The runtime and verify know this interface; SQLite stands behind it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/result.h"
#include "common/texture_tile.h"

namespace scree {

/// Seeds are the textures' pixels at one level, for updates (docs/resume-and-update.md); the runtime reads none.
enum class TileKind : int { height = 0, texture = 1, seed = 3 };
inline constexpr std::array kTileKinds{TileKind::height, TileKind::texture, TileKind::seed};

/// A row as stored.
struct TileRow {
    int codec = 0;
    std::vector<std::uint8_t> payload;
};

/// One thread's access to a store. Checksums are checked on every read.
class TileReader {
public:
    virtual ~TileReader() = default;
    /// Reads a row into `row` (its buffer is reused). False: there is no such tile. Errors: ErrorCode::store for a
    /// checksum that does not match, ErrorCode::io for what the file system says.
    virtual Result<bool> read(TileKind kind, TileId id, TileRow& row) = 0;
};

/// Thread-safe.
class TileStore {
public:
    virtual ~TileStore() = default;
    virtual const Dataset& dataset() const = 0;
    virtual Result<std::unique_ptr<TileReader>> open_reader() const = 0;
    /// Readers of this store may see rows of a later state. What was read before this said false is of the state that
    /// was opened.
    virtual bool is_rewritten() const { return false; }
};

/// Reads and decodes; a missing tile is an error (ErrorCode::store) that names it.
Result<HeightTile> read_height_tile(TileReader& reader, const Dataset& dataset, TileId id);
Result<TextureTile> read_texture_tile(TileReader& reader, const Dataset& dataset, TileId id);

}  // namespace scree
