#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/scene/scene.h"
#include "radbake/v1/plan.pb.h"

namespace radbake::cli {

/// A plan as one page: facts of the scene, every effect with its reason (what is on first, what is absent in one line),
/// methods with why, what is predicted by stage, the costliest meshes, warnings.
///
/// `scene_name`: of the file. `warnings`: of the scene's reader; they come before the plan's own.
std::string plan_page(const v1::Plan& plan, const std::string& scene_name, const std::vector<Warning>& warnings);

/// The same as one object: `effects` first, each {effect, state, reason, value, seconds, is_forced}, where seconds are
/// what it costs, or would cost where it is off (0: nothing worth a prediction); then the rest of the plan by its
/// messages. `warnings` of the reader stand before the plan's own.
nlohmann::ordered_json plan_json(const v1::Plan& plan, const std::vector<Warning>& warnings);

}  // namespace radbake::cli
