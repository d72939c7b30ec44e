// PROJ's objects with owners. Private to the files that call PROJ: everyone else includes crs.h. A context and what was
// made in it belong to one thread at a time.
#pragma once

#include <memory>
#include <string>

#include <proj.h>
// Taking CRS apart and putting them together has been "experimental" and the same since PROJ 6.
#include <proj_experimental.h>

namespace scree::proj {

struct Delete {
    void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
    void operator()(PJ* object) const { proj_destroy(object); }
    void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
    void operator()(PJ_OPERATION_FACTORY_CONTEXT* factory) const { proj_operation_factory_context_destroy(factory); }
};
using Context = std::unique_ptr<PJ_CONTEXT, Delete>;
using Object = std::unique_ptr<PJ, Delete>;
using List = std::unique_ptr<PJ_OBJ_LIST, Delete>;
using Factory = std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, Delete>;

/// Silent, and without the network whatever the environment says.
Context make_context();

/// A CRS from text; null where PROJ knows none.
Object create_crs(PJ_CONTEXT* context, const std::string& text);

/// The horizontal, two-dimensional part of a CRS; null where it has none (geocentric, vertical, local).
Object horizontal_part(PJ_CONTEXT* context, const PJ* crs);

/// What carries the axes: the base of a CRS that is bound to a datum shift, else the CRS itself.
Object unbound(PJ_CONTEXT* context, const PJ* crs);

/// Alike for coordinates in the order x, y.
bool equivalent(PJ_CONTEXT* context, const PJ* a, const PJ* b);

}  // namespace scree::proj
