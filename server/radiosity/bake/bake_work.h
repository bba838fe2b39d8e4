#pragma once

#include <vector>

#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/plan/predict.h"

namespace radbake::radiosity {

/// Counts what a prepared bake has to do; rays, entries and sweeps as settings and bounds tell.
BakeWork count_work(const Preparation& prepared, double preparing_seconds);

/// A host's own costs, and the usual ones where it has none.
HostCosts or_usual(const HostCosts& own);

/// The up to three meshes whose texels, vertices and patches take most time.
std::vector<MeshPrediction> costliest_meshes(const Preparation& prepared, const BakeWork& work, const HostCosts& costs);

/// What each effect of a plan that is not absent costs where it is on, or would cost where it is off.
///
///   a light             its share of the shadow rays             occlusion         what the tree takes of them
///   interreflection     form factors and solve                   color             two thirds of the solve
///   two_sided           the rows of backs                        tint, alpha_mask  what is see-through in rays' way
std::vector<EffectSeconds> seconds_by_effect(const Preparation& prepared, const BakeWork& work, const HostCosts& costs);

}  // namespace radbake::radiosity
