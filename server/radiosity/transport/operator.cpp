#include "server/radiosity/transport/operator.h"

#include "common/base/check.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

template <Channels C>
void gather_rows(const TransportOperator& transport, std::span<const C> radiosity, std::span<C> irradiance) {
  RADBAKE_CHECK_EQ(radiosity.size(), transport.size());
  RADBAKE_CHECK_EQ(irradiance.size(), transport.size());
  for_each_range(transport.size(), transport.rows_per_task(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      irradiance[i] = transport.gather_at(static_cast<std::uint32_t>(i), radiosity);
    }
  });
}

}  // namespace

void TransportOperator::gather(std::span<const Vec3> radiosity, std::span<Vec3> irradiance) const {
  gather_rows(*this, radiosity, irradiance);
}

void TransportOperator::gather(std::span<const double> radiosity, std::span<double> irradiance) const {
  gather_rows(*this, radiosity, irradiance);
}

}  // namespace radbake::radiosity
