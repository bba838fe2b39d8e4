#include "tests/invariant/bake_support.h"

#include <gtest/gtest.h>

namespace radbake::tests {

radiosity::BakeOutcome baked(const Scene& scene, const radiosity::BakeOptions& options) {
  SilentObserver observer;
  auto outcome = radiosity::bake_scene(scene, options, observer);
  EXPECT_TRUE(outcome.ok()) << outcome.error().message;
  return outcome.ok() ? std::move(outcome).value() : radiosity::BakeOutcome{};
}

}  // namespace radbake::tests
