#include "server/radiosity/transport/operator.h"

#include "common/base/check.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {

void TransportOperator::gather(std::span<const Vec3> radiosity, std::span<Vec3> irradiance) const {
  RADBAKE_CHECK_EQ(radiosity.size(), size());
  RADBAKE_CHECK_EQ(irradiance.size(), size());
  for_each_range(size(), rows_per_task(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) irradiance[i] = gather_at(static_cast<std::uint32_t>(i), radiosity);
  });
}

}  // namespace radbake::radiosity
