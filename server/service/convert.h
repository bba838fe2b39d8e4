#pragma once

#include "common/base/digest.h"
#include "radbake/v1/bake.pb.h"
#include "radbake/v1/content.pb.h"
#include "server/jobs/job.h"
#include "server/store/job_record.h"

namespace radbake::service {

// The wire's messages and our own types, both ways.

Digest from_message(const v1::Digest& digest);
v1::Digest to_message(const Digest& digest);

jobs::JobProgress from_message(const v1::Progress& progress);
v1::Progress to_message(const jobs::JobProgress& progress);

v1::BakeEvent to_message(const store::JobEvent& event);
/// With the progress where there is one.
v1::Bake to_message(const store::JobRecord& record, const jobs::Job::LatestProgress& latest);
v1::Bake to_message(const jobs::Job& job);

}  // namespace radbake::service
