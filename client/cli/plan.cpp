#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/plan_page.h"
#include "client/cli/proto_json.h"
#include "client/cli/reached_error.h"
#include "client/cli/requests.h"
#include "client/cli/send_scene.h"
#include "client/options/target_options.h"

namespace radbake::cli {
namespace {

/// Asks for the plan of an uploaded scene: by PlanBake, or by what a submit would send.
Result<v1::Plan> ask(const CommandContext& context, api::Client& client, const Digest& manifest) {
  const std::stop_token stop = context.interrupt.once();
  if (context.line.command == Command::kPlan) return client.plan(plan_request(context.line, manifest), stop);
  v1::SubmitBakeRequest request = submit_request(context.line, manifest);
  request.set_validate_only(true);
  RADBAKE_ASSIGN_OR_RETURN(v1::Bake answer, client.submit(request, stop));
  if (answer.name().empty() && answer.has_plan()) return std::move(*answer.mutable_plan());
  // A server that does not know the field has queued a bake.
  if (!answer.name().empty()) RADBAKE_RETURN_IF_ERROR(client.cancel(answer.name()));
  return Error{ErrorCode::kFailedPrecondition,
               "the server is too old for --dry-run: " +
                   (answer.name().empty() ? "it sent no plan" : "it queued " + answer.name() + ", now cancelled")};
}

}  // namespace

ExitCode run_plan(const CommandContext& context) {
  Stopwatch stages;
  context.reporter.stage("connecting", -1);
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  stages.end_stage("connect");
  const Result<void> within_limits = check_limits(context.line.bake, session->client.capabilities().limits());
  if (!within_limits.ok()) return fail(context, within_limits.error(), kUsage);

  const Result<ReadScene> read = read_and_encode(context, stages);
  if (!read.ok()) return fail(context, read.error());
  const Result<void> uploaded = upload(context, session->client, read->encoded, stages);
  if (!uploaded.ok()) return fail(context, session->explain(uploaded.error()));
  context.reporter.stage("planning", -1);
  const Result<v1::Plan> plan = ask(context, session->client, read->encoded.manifest);
  if (!plan.ok()) return fail(context, session->explain(plan.error()));
  stages.end_stage("plan");

  const std::string name = to_utf8(context.line.scene.filename().string());
  nlohmann::ordered_json json = plan_json(*plan, read->report.warnings);
  nlohmann::ordered_json& client = json["client_stages"] = nlohmann::ordered_json::array();
  for (const v1::StageSeconds& stage : stages.stages()) client.push_back(to_json(stage));
  context.reporter.answer(plan_page(*plan, name, read->report.warnings), json);
  const BakeChoices& bake = context.line.bake;
  if (const double asked = options::asked_error(bake); asked > 0 || bake.time_budget_ms > 0) {
    context.reporter.note("this is the first pass; others follow until " +
                          (asked > 0 ? "the error is " + error_percent(asked) : std::string("the time is up")));
  }
  return kDone;
}

}  // namespace radbake::cli
