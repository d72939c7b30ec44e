// An audit as one page of HTML that needs nothing else: the verdict, true errors against the promise, pictures of the
// audited poses, cracks and holes. Pure.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/app/audit_result.h"
#include "runtime/app/page_parts.h"

namespace scree {

std::string audit_verdict(const AuditResult& result, const AuditFacts& facts);

/// `no_pictures`: why there are none; empty where there are. Errors: ErrorCode::io (no memory for a picture).
Result<std::string> audit_page(const AuditResult& result, const AuditFacts& facts,
                               const std::vector<PosePicture>& pictures, const std::string& no_pictures);

}  // namespace scree
