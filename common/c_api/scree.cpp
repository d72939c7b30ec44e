#include "common/c_api/scree.h"

#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <string>

#include "common/query/ground.h"
#include "common/store/sqlite_store.h"

struct scree_store {
    std::unique_ptr<scree::SqliteStore> store;
    std::unique_ptr<scree::Ground> ground;  // goes first
    std::string info;
};

namespace {

using scree::Error;
using scree::ErrorCode;

std::string& last_message() {
    thread_local std::string message;
    return message;
}

scree_status fail(const Error& error) {
    last_message() = error.message;
    switch (error.code) {
        case ErrorCode::usage:
            return SCREE_ERROR_USAGE;
        case ErrorCode::input:
            return SCREE_ERROR_INPUT;
        case ErrorCode::store:
            return SCREE_ERROR_STORE;
        default:
            return SCREE_ERROR_IO;
    }
}

scree_status usage(const char* message) { return fail({ErrorCode::usage, message}); }

// Nothing throws into C.
template <class Work>
scree_status guarded(Work work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return fail({ErrorCode::io, "out of memory"});
    } catch (const std::exception& error) {
        return fail({ErrorCode::io, error.what()});
    }
}

scree_status open(const char* path, scree_store** out) {
    auto made = std::make_unique<scree_store>();
    auto store = scree::SqliteStore::open(path);
    if (!store) return fail(store.error());
    made->store = std::move(*store);
    auto ground = scree::Ground::open(*made->store);
    if (!ground) return fail(ground.error());
    made->ground = std::move(*ground);
    made->info = scree::dataset_to_json(made->store->dataset());
    *out = made.release();
    return SCREE_OK;
}

}  // namespace

scree_status scree_open(const char* path, scree_store** store) {
    if (store == nullptr) return usage("scree_open: store is null");
    *store = nullptr;
    if (path == nullptr) return usage("scree_open: path is null");
    return guarded([&] { return open(path, store); });
}

void scree_close(scree_store* store) { delete store; }

const char* scree_info(const scree_store* store) { return store == nullptr ? "" : store->info.c_str(); }

scree_status scree_height(scree_store* store, double x_m, double y_m, double* height_m, double* error_bound_m) {
    if (store == nullptr) return usage("scree_height: store is null");
    return guarded([&] {
        const auto height = store->ground->height(x_m, y_m);
        if (!height) return fail(height.error());
        if (!*height) return SCREE_ABSENT;
        if (height_m != nullptr) *height_m = (*height)->height_m;
        if (error_bound_m != nullptr) *error_bound_m = (*height)->error_bound_m;
        return SCREE_OK;
    });
}

scree_status scree_heights(scree_store* store, const double* xy_m, size_t count, double* heights_m) {
    if (store == nullptr || (count > 0 && (xy_m == nullptr || heights_m == nullptr)))
        return usage("scree_heights: store, xy_m or heights_m is null");
    for (size_t k = 0; k < count; ++k) {
        heights_m[k] = std::numeric_limits<double>::quiet_NaN();
        const scree_status status = scree_height(store, xy_m[2 * k], xy_m[2 * k + 1], &heights_m[k], nullptr);
        if (status > SCREE_OK) return status;
    }
    return SCREE_OK;
}

scree_status scree_lon_lat(scree_store* store, double x_m, double y_m, double* longitude_deg, double* latitude_deg) {
    if (store == nullptr) return usage("scree_lon_lat: store is null");
    return guarded([&] {
        const auto& grid = store->store->dataset().geo_grid;
        const auto at = grid ? grid->lon_lat(x_m, y_m) : std::nullopt;
        if (!at) return SCREE_ABSENT;
        if (longitude_deg != nullptr) *longitude_deg = at->longitude_deg;
        if (latitude_deg != nullptr) *latitude_deg = at->latitude_deg;
        return SCREE_OK;
    });
}

scree_status scree_place(scree_store* store, double longitude_deg, double latitude_deg, double* x_m, double* y_m) {
    if (store == nullptr) return usage("scree_place: store is null");
    return guarded([&] {
        const auto& grid = store->store->dataset().geo_grid;
        const auto place = grid ? grid->place({longitude_deg, latitude_deg}) : std::nullopt;
        if (!place) return SCREE_ABSENT;
        if (x_m != nullptr) *x_m = (*place)[0];
        if (y_m != nullptr) *y_m = (*place)[1];
        return SCREE_OK;
    });
}

const char* scree_error_message(void) { return last_message().c_str(); }

const char* scree_version(void) { return SCREE_VERSION; }
