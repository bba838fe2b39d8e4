#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "server/access/caller.h"
#include "server/jobs/job_queue.h"

namespace radbake::service {

/// A job that a caller may see: one of his tenant, any for an admin.
/// Errors: kNotFound, word for word the same for a job that is another's as for one that does not exist.
Result<std::shared_ptr<jobs::Job>> find_visible(jobs::JobQueue& queue, const access::Caller& caller,
                                                const std::string& name);

}  // namespace radbake::service
