/* Scree from C, and from what calls C: what a store holds, and how high its terrain is.
 *
 *     scree_store* store;
 *     double height_m;
 *     if (scree_open("alps.scree", &store) != SCREE_OK) return fail(scree_error_message());
 *     if (scree_height(store, 412000.0, 5275000.0, &height_m, NULL) == SCREE_OK) printf("%f m\n", height_m);
 *     scree_close(store);
 *
 * A store is for one thread at a time; different ones are independent. Coordinates are metres in the store's CRS, which
 * scree_info() names. Link libscree_common and the C++ runtime; CMake's scree::common does. */
#ifndef SCREE_H
#define SCREE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Numbers of errors are the exit codes of the programs. */
typedef enum scree_status {
    SCREE_ABSENT = -1,     /* no error: there is nothing there */
    SCREE_OK = 0,          /* done */
    SCREE_ERROR_USAGE = 2, /* an argument that makes no sense */
    SCREE_ERROR_INPUT = 3, /* the file is missing or cannot be read */
    SCREE_ERROR_STORE = 4, /* damaged, not a store, or of a newer format */
    SCREE_ERROR_IO = 5     /* the file system or memory gave out */
} scree_status;

typedef struct scree_store scree_store;

/* Opens a .scree file (UTF-8 path) for reading; `*store` is null where that fails. */
scree_status scree_open(const char* path, scree_store** store);
/* Null is allowed. */
void scree_close(scree_store* store);

/* What the store says of itself, as JSON (docs/store-format.md, "Dataset"): lattice, CRS, datum, sources, and so on.
 * Valid until the store is closed. */
const char* scree_info(const scree_store* store);

/* Height of the finest stored terrain at (x_m, y_m), in metres, and within how many metres of it the true height is.
 * Either of the two may be null. SCREE_ABSENT leaves them as they are. */
scree_status scree_height(scree_store* store, double x_m, double y_m, double* height_m, double* error_bound_m);

/* The same of `count` points: xy_m holds x and y in turn; heights_m takes `count` numbers, NaN where there is no
 * terrain. Points near one another are answered fastest in a row. */
scree_status scree_heights(scree_store* store, const double* xy_m, size_t count, double* heights_m);

/* Longitude (-180..180, east positive) and latitude (geodetic), WGS 84 degrees, of (x_m, y_m), as exact as the store
 * says ("geo_grid" of scree_info()). Either of the two may be null. SCREE_ABSENT leaves them as they are: the store
 * knows no longitudes and latitudes (it has no CRS, or was made before stores had them), or not so far out. */
scree_status scree_lon_lat(scree_store* store, double x_m, double y_m, double* longitude_deg, double* latitude_deg);

/* The place of a longitude and latitude: the way back. SCREE_ABSENT likewise. */
scree_status scree_place(scree_store* store, double longitude_deg, double latitude_deg, double* x_m, double* y_m);

/* Why the last call on this thread that returned an error failed: for people, UTF-8, valid until the next one that
 * does. Empty where none did. */
const char* scree_error_message(void);

/* Version of the library, such as "0.1.0". */
const char* scree_version(void);

#ifdef __cplusplus
}
#endif

#endif
