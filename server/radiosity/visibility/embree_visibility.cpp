#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "common/base/check.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {
namespace {

constexpr int kPacket = 16;
/// Wider by what single precision may move points, triangles and distances.
constexpr double kRounding = 0x1p-20;
/// Along the axis of a shaft; a longer one has longer spheres.
constexpr int kMostSpheres = 8;

/// What is the same for all rays, in all lanes: Embree leaves it as it is.
template <typename Packet>
void set_constants(Packet& packet) {
  for (int k = 0; k < kPacket; ++k) {
    packet.tnear[k] = 0;
    packet.time[k] = 0;
    packet.mask[k] = 0xffffffffu;
    packet.id[k] = static_cast<unsigned>(k);
    packet.flags[k] = 0;
  }
}

/// Fills lane k of a packet; lanes without a ray are switched off by `valid`.
template <typename Packet>
void set_lane(Packet& packet, int k, const Ray& ray) {
  packet.org_x[k] = ray.origin[0];
  packet.org_y[k] = ray.origin[1];
  packet.org_z[k] = ray.origin[2];
  packet.dir_x[k] = ray.direction[0];
  packet.dir_y[k] = ray.direction[1];
  packet.dir_z[k] = ray.direction[2];
  packet.tfar[k] = ray.max_distance;
}

class EmbreeVisibility final : public Visibility {
 public:
  EmbreeVisibility(std::span<const Corners> triangles, const std::stop_token& stop) {
    device_ = rtcNewDevice(nullptr);
    RADBAKE_CHECK(device_ != nullptr);
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), 3 * triangles.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), triangles.size()));
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (int corner = 0; corner < 3; ++corner) {
        const std::size_t at = 3 * t + corner;
        for (int axis = 0; axis < 3; ++axis) vertices[3 * at + axis] = static_cast<float>(triangles[t][corner][axis]);
        indices[at] = static_cast<unsigned>(at);
      }
    }
    vertices_ = vertices;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    // Build on one thread: ties between coplanar triangles are decided by the tree's order, and a tree that was built
    // by several threads may order its leaves by chance. Not rtcJoinCommitScene(): that works in an arena of its own.
    tbb::task_arena one_thread(1);
    const auto goes_on = [](void* token, double) {
      return !static_cast<const std::stop_token*>(token)->stop_requested();
    };
    rtcSetSceneProgressMonitorFunction(scene_, goes_on, const_cast<std::stop_token*>(&stop));
    one_thread.execute([this] { rtcCommitScene(scene_); });
    rtcSetSceneProgressMonitorFunction(scene_, nullptr, nullptr);
    const RTCError error = rtcGetDeviceError(device_);
    is_built_ = error != RTC_ERROR_CANCELLED;
    RADBAKE_CHECK(!is_built_ || error == RTC_ERROR_NONE);
  }

  bool is_built() const { return is_built_; }

  ~EmbreeVisibility() override {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeVisibility(const EmbreeVisibility&) = delete;
  EmbreeVisibility& operator=(const EmbreeVisibility&) = delete;

  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override {
    RADBAKE_CHECK_EQ(rays.size(), hits.size());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    alignas(64) int valid[kPacket];
    RTCRayHit16 packet;
    set_constants(packet.ray);
    for (std::size_t first = 0; first < rays.size(); first += kPacket) {
      const int count = static_cast<int>(std::min<std::size_t>(kPacket, rays.size() - first));
      for (int k = 0; k < kPacket; ++k) {
        valid[k] = k < count ? -1 : 0;
        set_lane(packet.ray, k, rays[first + std::min(k, count - 1)]);
        packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      }
      rtcIntersect16(valid, scene_, &context, &packet);
      for (int k = 0; k < count; ++k) {
        const bool is_hit = packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
        hits[first + k] = is_hit ? Hit{packet.hit.primID[k], packet.hit.u[k], packet.hit.v[k]} : Hit{};
      }
    }
  }

  void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const override {
    RADBAKE_CHECK_EQ(segments.size(), blocked.size());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    alignas(64) int valid[kPacket];
    RTCRay16 packet;
    set_constants(packet);
    for (std::size_t first = 0; first < segments.size(); first += kPacket) {
      const int count = static_cast<int>(std::min<std::size_t>(kPacket, segments.size() - first));
      for (int k = 0; k < kPacket; ++k) {
        valid[k] = k < count ? -1 : 0;
        set_lane(packet, k, segments[first + std::min(k, count - 1)]);
      }
      rtcOccluded16(valid, scene_, &context, &packet);
      for (int k = 0; k < count; ++k) blocked[first + k] = packet.tfar[k] < 0;
    }
  }

  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    triangles.clear();
    const auto collect = [](RTCPointQueryFunctionArguments* found) {
      static_cast<std::vector<std::uint32_t>*>(found->userPtr)->push_back(found->primID);
      return false;  // the radius stays as it is
    };
    query_sphere(point, distance, collect, &triangles);
    std::sort(triangles.begin(), triangles.end());
  }

  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    RADBAKE_CHECK_LT(0.0, shaft.radius);
    triangles.clear();
    Search search{shaft, vertices_, triangles};
    const auto collect = [](RTCPointQueryFunctionArguments* found) {
      const Search& search = *static_cast<const Search*>(found->userPtr);
      Corners corners;
      double size = 0;
      for (int corner = 0; corner < 3; ++corner) {
        for (int axis = 0; axis < 3; ++axis) {
          corners[corner][axis] = search.vertices[9 * std::size_t{found->primID} + 3 * corner + axis];
          size = std::max(size, std::fabs(corners[corner][axis]));
        }
      }
      if (search.shaft.may_hold(corners, kRounding * (1 + size))) search.triangles.push_back(found->primID);
      return false;
    };
    // Cover the shaft with spheres along its axis, about as long as they are wide.
    const Vec3 axis = shaft.end - shaft.begin;
    const double whole = length(axis);
    const int num_spheres = static_cast<int>(std::clamp(whole / (2 * shaft.radius), 1.0, double{kMostSpheres}));
    const double half_step = whole / (2 * num_spheres);
    const double radius = std::hypot(half_step, shaft.radius) + (num_spheres > 1 ? 0 : shaft.radius);
    for (int k = 0; k < num_spheres; ++k) {
      query_sphere(shaft.begin + axis * ((k + 0.5) / num_spheres), radius, collect, &search);
    }
    // The caps beyond both ends.
    if (num_spheres > 1) {
      query_sphere(shaft.begin, shaft.radius, collect, &search);
      query_sphere(shaft.end, shaft.radius, collect, &search);
    }
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  }

  std::string instruction_set() const override {
    if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) return "avx512";
    if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) return "avx";
    return "sse";
  }

 private:
  struct Search {
    const Shaft& shaft;
    const float* vertices;
    std::vector<std::uint32_t>& triangles;
  };

  void query_sphere(Vec3 centre, double radius, RTCPointQueryFunction collect, void* user) const {
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query{};
    query.x = static_cast<float>(centre.x);
    query.y = static_cast<float>(centre.y);
    query.z = static_cast<float>(centre.z);
    query.radius = static_cast<float>(radius + kRounding * (1 + radius + length(centre)));
    rtcPointQuery(scene_, &query, &context, collect, user);
  }

  const float* vertices_ = nullptr;  ///< [9 x triangles], of the geometry
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  bool is_built_ = false;
};

}  // namespace

std::unique_ptr<Visibility> make_embree_visibility(std::span<const Corners> triangles, std::stop_token stop) {
  auto visibility = std::make_unique<EmbreeVisibility>(triangles, stop);
  if (!visibility->is_built()) return nullptr;
  return visibility;
}

}  // namespace radbake::radiosity
