#include "c_api_checks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/c_api/scree.h"

static int failures;

#define CHECK(condition)                                                                                \
    do {                                                                                                \
        if (!(condition)) {                                                                             \
            ++failures;                                                                                 \
            fprintf(stderr, "%s:%d: %s (%s)\n", __FILE__, __LINE__, #condition, scree_error_message()); \
        }                                                                                               \
    } while (0)

static int same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

static void check_one_by_one(scree_store* store, const struct c_api_point* points, int count) {
    int k;
    for (k = 0; k < count; ++k) {
        const struct c_api_point* p = &points[k];
        double height_m = -1, bound_m = -1;
        const scree_status status = scree_height(store, p->x_m, p->y_m, &height_m, &bound_m);
        if (isnan(p->height_m)) {
            CHECK(status == SCREE_ABSENT);
            CHECK(height_m == -1 && bound_m == -1);
        } else {
            CHECK(status == SCREE_OK);
            CHECK(same(height_m, p->height_m));
            CHECK(same(bound_m, p->error_bound_m));
        }
        CHECK(scree_height(store, p->x_m, p->y_m, NULL, NULL) == status);
    }
}

static void check_together(scree_store* store, const struct c_api_point* points, int count) {
    double* xy_m = malloc(2 * (size_t)count * sizeof(double));
    double* heights_m = malloc((size_t)count * sizeof(double));
    int k;
    for (k = 0; k < count; ++k) {
        xy_m[2 * k] = points[k].x_m;
        xy_m[2 * k + 1] = points[k].y_m;
        heights_m[k] = -1;
    }
    CHECK(scree_heights(store, xy_m, (size_t)count, heights_m) == SCREE_OK);
    for (k = 0; k < count; ++k) CHECK(same(heights_m[k], points[k].height_m));
    CHECK(scree_heights(store, NULL, 0, NULL) == SCREE_OK);
    CHECK(scree_heights(store, NULL, 1, heights_m) == SCREE_ERROR_USAGE);
    free(heights_m);
    free(xy_m);
}

int check_heights(const char* path, const struct c_api_point* points, int count) {
    scree_store* store = NULL;
    failures = 0;
    CHECK(scree_open(path, &store) == SCREE_OK);
    if (store == NULL) return failures;
    check_one_by_one(store, points, count);
    check_together(store, points, count);
    scree_close(store);
    return failures;
}

int check_info(const char* path, const char* expected_json) {
    scree_store* store = NULL;
    failures = 0;
    CHECK(scree_open(path, &store) == SCREE_OK);
    CHECK(strcmp(scree_info(store), expected_json) == 0);
    CHECK(scree_info(store) == scree_info(store));
    CHECK(strlen(scree_version()) >= 5);
    scree_close(store);
    scree_close(NULL);
    return failures;
}

int check_places(const char* path, double x_m, double y_m, double longitude_deg, double latitude_deg) {
    scree_store* store = NULL;
    double longitude = -7, latitude = -8, x = -9, y = -10;
    failures = 0;
    CHECK(scree_open(path, &store) == SCREE_OK);
    if (store == NULL) return failures;
    if (isnan(longitude_deg)) {
        CHECK(scree_lon_lat(store, x_m, y_m, &longitude, &latitude) == SCREE_ABSENT);
        CHECK(scree_place(store, 0, 0, &x, &y) == SCREE_ABSENT);
    } else {
        CHECK(scree_lon_lat(store, x_m, y_m, NULL, NULL) == SCREE_OK);
        CHECK(scree_lon_lat(store, x_m + 1e9, y_m, &longitude, &latitude) == SCREE_ABSENT);
        CHECK(scree_lon_lat(store, NAN, y_m, &longitude, &latitude) == SCREE_ABSENT);
        CHECK(scree_place(store, longitude_deg + 90, latitude_deg, &x, &y) == SCREE_ABSENT);
        CHECK(scree_place(store, longitude_deg, 91, &x, &y) == SCREE_ABSENT);
    }
    CHECK(longitude == -7 && latitude == -8 && x == -9 && y == -10);
    if (!isnan(longitude_deg)) {
        CHECK(scree_lon_lat(store, x_m, y_m, &longitude, &latitude) == SCREE_OK);
        CHECK(longitude == longitude_deg && latitude == latitude_deg);
        CHECK(scree_place(store, longitude_deg, latitude_deg, NULL, NULL) == SCREE_OK);
        CHECK(scree_place(store, longitude_deg, latitude_deg, &x, &y) == SCREE_OK);
        CHECK(fabs(x - x_m) < 1e-4 && fabs(y - y_m) < 1e-4);
    }
    CHECK(scree_lon_lat(NULL, 0, 0, &longitude, &latitude) == SCREE_ERROR_USAGE);
    CHECK(scree_place(NULL, 0, 0, &x, &y) == SCREE_ERROR_USAGE);
    scree_close(store);
    return failures;
}

static void check_refused(const char* path, scree_status expected) {
    scree_store* store = (scree_store*)&failures;
    CHECK(scree_open(path, &store) == expected);
    CHECK(store == NULL);
    CHECK(strstr(scree_error_message(), path) != NULL);
}

int check_errors(const char* missing, const char* not_a_store, const char* damaged) {
    scree_store* store = NULL;
    double height_m = -1;
    failures = 0;
    check_refused(missing, SCREE_ERROR_INPUT);
    check_refused(not_a_store, SCREE_ERROR_STORE);
    CHECK(scree_open(NULL, &store) == SCREE_ERROR_USAGE && store == NULL);
    CHECK(scree_open(missing, NULL) == SCREE_ERROR_USAGE);
    CHECK(scree_height(NULL, 0, 0, NULL, NULL) == SCREE_ERROR_USAGE);
    CHECK(strcmp(scree_info(NULL), "") == 0);
    /* Its root's row does not match its checksum. */
    CHECK(scree_open(damaged, &store) == SCREE_OK);
    CHECK(scree_height(store, 1, -1, &height_m, NULL) == SCREE_ERROR_STORE);
    CHECK(scree_heights(store, (const double[]){1, -1}, 1, &height_m) == SCREE_ERROR_STORE);
    CHECK(isnan(height_m));
    scree_close(store);
    return failures;
}
