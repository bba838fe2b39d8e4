#include "server/service/convert.h"

#include "server/service/status.h"

namespace radbake::service {

// JobState is stored by number and sent by number.
static_assert(static_cast<int>(store::JobState::kQueued) == v1::QUEUED);
static_assert(static_cast<int>(store::JobState::kPreparing) == v1::PREPARING);
static_assert(static_cast<int>(store::JobState::kFormFactors) == v1::FORM_FACTORS);
static_assert(static_cast<int>(store::JobState::kSolving) == v1::SOLVING);
static_assert(static_cast<int>(store::JobState::kGathering) == v1::GATHERING);
static_assert(static_cast<int>(store::JobState::kWriting) == v1::WRITING);
static_assert(static_cast<int>(store::JobState::kSucceeded) == v1::SUCCEEDED);
static_assert(static_cast<int>(store::JobState::kFailed) == v1::FAILED);
static_assert(static_cast<int>(store::JobState::kCancelled) == v1::CANCELLED);

Digest from_message(const v1::Digest& digest) { return {digest.sha256(), digest.size_bytes()}; }

v1::Digest to_message(const Digest& digest) {
  v1::Digest message;
  message.set_sha256(digest.sha256);
  message.set_size_bytes(digest.size_bytes);
  return message;
}

jobs::JobProgress from_message(const v1::Progress& progress) {
  jobs::JobProgress own;
  own.state = static_cast<store::JobState>(progress.state());
  own.fraction = progress.fraction();
  own.steps_done = progress.steps_done();
  own.steps_total = progress.steps_total();
  own.seconds_left = progress.seconds_left();
  own.residual = progress.residual();
  own.pass = progress.pass();
  own.relative_error = progress.relative_error();
  own.relative_error_low = progress.relative_error_low();
  own.relative_error_high = progress.relative_error_high();
  own.asked_error = progress.asked_error();
  return own;
}

v1::Progress to_message(const jobs::JobProgress& progress) {
  v1::Progress message;
  message.set_state(static_cast<v1::BakeState>(progress.state));
  message.set_fraction(progress.fraction);
  message.set_steps_done(progress.steps_done);
  message.set_steps_total(progress.steps_total);
  message.set_seconds_left(progress.seconds_left);
  message.set_residual(progress.residual);
  message.set_pass(progress.pass);
  message.set_relative_error(progress.relative_error);
  message.set_relative_error_low(progress.relative_error_low);
  message.set_relative_error_high(progress.relative_error_high);
  message.set_asked_error(progress.asked_error);
  return message;
}

v1::BakeEvent to_message(const store::JobEvent& event) {
  v1::BakeEvent message;
  message.set_sequence(event.sequence);
  message.set_unix_ms(event.unix_ms);
  message.set_state(static_cast<v1::BakeState>(event.state));
  message.set_attempt(event.attempt);
  message.set_message(event.message);
  return message;
}

v1::Bake to_message(const store::JobRecord& record, const jobs::Job::LatestProgress& latest) {
  v1::Bake bake;
  bake.set_name(record.name);
  bake.set_state(static_cast<v1::BakeState>(record.state));
  bake.set_attempt(record.attempt);
  bake.set_last_sequence(record.last_sequence);
  bake.set_bake_key(record.bake_key);
  bake.set_label(record.label);
  bake.set_created_unix_ms(record.created_unix_ms);
  bake.set_finished_unix_ms(record.finished_unix_ms);
  *bake.mutable_manifest() = to_message(record.work.manifest);
  bake.mutable_settings()->ParseFromString(record.work.settings);
  bake.set_priority(record.owner.priority);
  bake.set_from_store(record.is_from_store);
  bake.set_trace_id(record.owner.trace_id);
  if (latest.version > 0) *bake.mutable_progress() = to_message(latest.progress);
  if (!record.result.empty()) bake.mutable_result()->ParseFromString(record.result);
  if (record.error) *bake.mutable_error() = to_message(*record.error);
  return bake;
}

v1::Bake to_message(const jobs::Job& job) { return to_message(job.record(), job.progress()); }

}  // namespace radbake::service
