// Ground: heights of the finest stored surface and rays against it, read through the store as asked for: exact, and
// independent of what is drawn. Reads block. One thread per object.
#pragma once

#include <list>
#include <memory>
#include <optional>

#include "common/query/height_query.h"
#include "common/query/ray_cast.h"
#include "common/store/tile_store.h"

namespace scree {

class Ground final : public HeightSource {
public:
    /// `store` must outlive the object.
    static Result<std::unique_ptr<Ground>> open(const TileStore& store);

    /// As height_at, with a single read where there is ground as deep as where it was last asked for. Errors: those of
    /// the store.
    Result<std::optional<HeightAt>> height(double x_m, double y_m);
    /// As scree::cast_ray.
    Result<std::optional<RayHit>> cast_ray(const Vector3& origin, const Vector3& direction, double max_distance_m) {
        return scree::cast_ray(*this, origin, direction, max_distance_m);
    }
    /// A tile of any level, or null where none is stored. Valid until the next call.
    Result<const HeightTile*> tile(TileId id);

    const Dataset& dataset() const override { return store_.dataset(); }
    /// A child that its parent names and the store lacks is an error (ErrorCode::store).
    Result<std::optional<HeightTileView>> view(TileId id) override;

private:
    Ground(const TileStore& store, std::unique_ptr<TileReader> reader);
    Result<std::optional<HeightAt>> leaf_height(std::int64_t ci, std::int64_t cj, double i, double j);

    const TileStore& store_;
    std::unique_ptr<TileReader> reader_;
    struct Cached {
        TileId id;
        std::optional<HeightTile> tile;
    };
    std::list<Cached> recent_;
    int leaf_level_;  ///< of the last leaf that answered
};

}  // namespace scree
