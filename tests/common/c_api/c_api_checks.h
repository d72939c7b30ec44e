/* What a C program meets, compiled as C. */
#ifndef SCREE_C_API_CHECKS_H
#define SCREE_C_API_CHECKS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Points of a store, and what C++ says of them; height_m is NaN where there is no terrain. */
struct c_api_point {
    double x_m, y_m, height_m, error_bound_m;
};

/* Each returns how many things were wrong, and says which on standard error. */
int check_heights(const char* store, const struct c_api_point* points, int count);
int check_info(const char* store, const char* expected_json);
/* Longitude and latitude of the first point, NaN where the store has none; and beyond its box. */
int check_places(const char* store, double x_m, double y_m, double longitude_deg, double latitude_deg);
int check_errors(const char* missing, const char* not_a_store, const char* damaged);

#ifdef __cplusplus
}
#endif

#endif
