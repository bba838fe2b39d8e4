#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

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

/// Embree's tree: one geometry of the opaque triangles, and one of those that are see-through, with callbacks.
class Tree {
 public:
  Tree(std::span<const Corners> triangles, const std::stop_token& stop, const Opacity* opacity) : opacity_(opacity) {
    device_.reset(rtcNewDevice(nullptr));
    check_memory(rtcGetDeviceError(device_.get()));
    RADBAKE_CHECK(device_ != nullptr);
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene(), RTC_SCENE_FLAG_ROBUST);
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      ids_[opacity != nullptr && opacity->is_see_through(t)].push_back(t);
    }
    for (int kind = 0; kind < 2; ++kind) {
      if (!ids_[kind].empty()) attach(triangles, kind);
    }
    // Build on one thread: ties between coplanar triangles are decided by the tree's order, and a tree that was built
    // by several threads may order its leaves by chance. Not rtcJoinCommitScene(): that works in an arena of its own.
    tbb::task_arena one_thread(1);
    const auto goes_on = [](void* token, double) {
      return !static_cast<const std::stop_token*>(token)->stop_requested();
    };
    rtcSetSceneProgressMonitorFunction(scene(), goes_on, const_cast<std::stop_token*>(&stop));
    one_thread.execute([this] { rtcCommitScene(scene()); });
    rtcSetSceneProgressMonitorFunction(scene(), nullptr, nullptr);
    const RTCError error = rtcGetDeviceError(device());
    check_memory(error);
    is_built_ = error != RTC_ERROR_CANCELLED;
    RADBAKE_CHECK(!is_built_ || error == RTC_ERROR_NONE);
  }

  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  bool is_built() const { return is_built_; }
  bool is_see_through() const { return !ids_[kSeeThrough].empty(); }
  RTCScene scene() const { return scene_.get(); }
  RTCDevice device() const { return device_.get(); }
  const Opacity* opacity() const { return opacity_; }
  std::uint32_t triangle(unsigned geometry, unsigned primitive) const { return ids_[geometry][primitive]; }
  /// Nine numbers.
  const float* corners(unsigned geometry, unsigned primitive) const {
    return vertices_[geometry] + 9 * std::size_t{primitive};
  }

 private:
  static constexpr int kSeeThrough = 1;

  /// Embree reports by a code what everything else throws.
  static void check_memory(RTCError error) {
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  }

  void attach(std::span<const Corners> triangles, int kind) {
    const std::vector<std::uint32_t>& ids = ids_[kind];
    const std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> owner(
        rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE), &rtcReleaseGeometry);
    RTCGeometry geometry = owner.get();
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), 3 * ids.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), ids.size()));
    if (vertices == nullptr || indices == nullptr) throw std::bad_alloc();
    for (std::size_t t = 0; t < ids.size(); ++t) {
      for (int corner = 0; corner < 3; ++corner) {
        const std::size_t at = 3 * t + corner;
        const Vec3 position = triangles[ids[t]][corner];
        for (int axis = 0; axis < 3; ++axis) vertices[3 * at + axis] = static_cast<float>(position[axis]);
        indices[at] = static_cast<unsigned>(at);
      }
    }
    vertices_[kind] = vertices;
    if (kind == kSeeThrough) {
      rtcSetGeometryIntersectFilterFunction(geometry, pass_or_stop);
      rtcSetGeometryOccludedFilterFunction(geometry, weaken);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene(), geometry, static_cast<unsigned>(kind));
  }

  static void pass_or_stop(const RTCFilterFunctionNArguments* args);
  static void weaken(const RTCFilterFunctionNArguments* args);

  const Opacity* opacity_;
  std::array<std::vector<std::uint32_t>, 2> ids_;  ///< triangle of each primitive, by geometry
  std::array<const float*, 2> vertices_{};         ///< [9 x primitives], of the geometries
  std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device_{nullptr, &rtcReleaseDevice};
  std::unique_ptr<RTCSceneTy, decltype(&rtcReleaseScene)> scene_{nullptr, &rtcReleaseScene};
  bool is_built_ = false;
};

/// What the callbacks are told of a packet.
struct PacketContext {
  RTCIntersectContext base;  // first: Embree hands it back by this address
  const Tree* tree;
  int channel;
  Chances chances;
  std::array<std::uint32_t, kPacket> rays;  ///< of the batch, by RTCRayN_id
  std::array<bool, kPacket> differs;        ///< by RTCRayN_id: met what stops channels by different shares
  Vec3* transmitted;  ///< [kPacket] by RTCRayN_id; null: whether anything stands there is all that is asked
};

/// Lets a ray through with the probability 1 - opacity.
void Tree::pass_or_stop(const RTCFilterFunctionNArguments* args) {
  auto& context = *reinterpret_cast<PacketContext*>(args->context);
  for (unsigned k = 0; k < args->N; ++k) {
    if (args->valid[k] != -1) continue;
    const std::uint32_t triangle = context.tree->triangle(kSeeThrough, RTCHitN_primID(args->hit, args->N, k));
    const Vec3 opacity =
        context.tree->opacity_->opacity(triangle, RTCHitN_u(args->hit, args->N, k), RTCHitN_v(args->hit, args->N, k));
    const unsigned lane = RTCRayN_id(args->ray, args->N, k);
    if (opacity.x != opacity.y || opacity.y != opacity.z) context.differs[lane] = true;
    if (context.chances.of(context.rays[lane], triangle) >= opacity[context.channel]) args->valid[k] = 0;
  }
}

/// Takes from a segment what a point of it stops; ends it where nothing is left.
void Tree::weaken(const RTCFilterFunctionNArguments* args) {
  const auto& context = *reinterpret_cast<const PacketContext*>(args->context);
  for (unsigned k = 0; k < args->N; ++k) {
    if (args->valid[k] != -1) continue;
    const std::uint32_t triangle = context.tree->triangle(kSeeThrough, RTCHitN_primID(args->hit, args->N, k));
    const Vec3 opacity =
        context.tree->opacity_->opacity(triangle, RTCHitN_u(args->hit, args->N, k), RTCHitN_v(args->hit, args->N, k));
    if (context.transmitted == nullptr) {
      if (max_component(opacity) <= 0) args->valid[k] = 0;
      continue;
    }
    Vec3& left = context.transmitted[RTCRayN_id(args->ray, args->N, k)];
    left = scaled_by(left, Vec3{1, 1, 1} - opacity);
    if (max_component(left) > 0) args->valid[k] = 0;
  }
}

class EmbreeVisibility final : public Visibility {
 public:
  EmbreeVisibility(std::shared_ptr<const Tree> tree, int channel) : tree_(std::move(tree)), channel_(channel) {
    if (!tree_->is_see_through() || channel > 0) return;
    for (int c = 1; c < 3; ++c) others_[c - 1] = std::make_unique<EmbreeVisibility>(tree_, c);
  }

  bool is_see_through() const override { return tree_->is_see_through(); }
  const Visibility& channel(int c) const override { return c == 0 || !others_[c - 1] ? *this : *others_[c - 1]; }

  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override {
    RADBAKE_CHECK_EQ(rays.size(), hits.size());
    Tracer tracer(*this, rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) tracer.add(i);
    tracer.flush();
  }

  void trace_again(std::span<const Ray> rays, std::span<const std::uint8_t> wanted,
                   std::span<Hit> hits) const override {
    RADBAKE_CHECK_EQ(rays.size(), hits.size());
    RADBAKE_CHECK_EQ(rays.size(), wanted.size());
    Tracer tracer(*this, rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (wanted[i]) tracer.add(i);
    }
    tracer.flush();
  }

  void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const override {
    RADBAKE_CHECK_EQ(segments.size(), blocked.size());
    occlude(segments, nullptr, [&](std::size_t at, bool is_ended, Vec3) { blocked[at] = is_ended; });
  }

  void transmitted(std::span<const Ray> segments, std::span<Vec3> shares) const override {
    RADBAKE_CHECK_EQ(segments.size(), shares.size());
    std::array<Vec3, kPacket> left;
    occlude(segments, left.data(),
            [&](std::size_t at, bool is_ended, Vec3 share) { shares[at] = is_ended ? Vec3{} : share; });
  }

  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    triangles.clear();
    const auto collect = [](RTCPointQueryFunctionArguments* found) {
      const Near& near = *static_cast<const Near*>(found->userPtr);
      near.triangles.push_back(near.tree.triangle(found->geomID, found->primID));
      return false;  // the radius stays as it is
    };
    Near near{*tree_, triangles};
    query_sphere(point, distance, collect, &near);
    std::sort(triangles.begin(), triangles.end());
  }

  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    RADBAKE_CHECK_LT(0.0, shaft.radius);
    triangles.clear();
    Search search{shaft, *tree_, triangles};
    const auto collect = [](RTCPointQueryFunctionArguments* found) {
      const Search& search = *static_cast<const Search*>(found->userPtr);
      const float* numbers = search.tree.corners(found->geomID, found->primID);
      Corners corners;
      double size = 0;
      for (int corner = 0; corner < 3; ++corner) {
        for (int axis = 0; axis < 3; ++axis) {
          corners[corner][axis] = numbers[3 * corner + axis];
          size = std::max(size, std::fabs(corners[corner][axis]));
        }
      }
      if (search.shaft.may_hold(corners, kRounding * (1 + size))) {
        search.triangles.push_back(search.tree.triangle(found->geomID, found->primID));
      }
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
    if (rtcGetDeviceProperty(tree_->device(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) return "avx512";
    if (rtcGetDeviceProperty(tree_->device(), RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) return "avx";
    return "sse";
  }

 private:
  /// Rays of a batch, packet by packet.
  class Tracer {
   public:
    Tracer(const EmbreeVisibility& visibility, std::span<const Ray> rays, std::span<Hit> hits)
        : tree_(*visibility.tree_), context_(visibility.make_context(rays, nullptr)), rays_(rays), hits_(hits) {
      set_constants(packet_.ray);
    }

    void add(std::size_t ray) {
      context_.rays[count_] = static_cast<std::uint32_t>(ray);
      set_lane(packet_.ray, count_, rays_[ray]);
      if (++count_ == kPacket) flush();
    }

    void flush() {
      if (count_ == 0) return;
      alignas(64) int valid[kPacket];
      for (int k = 0; k < kPacket; ++k) {
        valid[k] = k < count_ ? -1 : 0;
        if (k >= count_) set_lane(packet_.ray, k, rays_[context_.rays[0]]);
        packet_.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        packet_.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      }
      context_.differs.fill(false);
      rtcIntersect16(valid, tree_.scene(), &context_.base, &packet_);
      for (int k = 0; k < count_; ++k) {
        Hit& hit = hits_[context_.rays[k]];
        const unsigned geometry = packet_.hit.geomID[k];
        hit = {};
        if (geometry != RTC_INVALID_GEOMETRY_ID) {
          hit = {tree_.triangle(geometry, packet_.hit.primID[k]), packet_.hit.u[k], packet_.hit.v[k],
                 packet_.ray.tfar[k]};
        }
        hit.differs_by_channel = context_.differs[k];
      }
      count_ = 0;
    }

   private:
    const Tree& tree_;
    PacketContext context_;
    std::span<const Ray> rays_;
    std::span<Hit> hits_;
    RTCRayHit16 packet_;
    int count_ = 0;
  };

  struct Near {
    const Tree& tree;
    std::vector<std::uint32_t>& triangles;
  };
  struct Search {
    const Shaft& shaft;
    const Tree& tree;
    std::vector<std::uint32_t>& triangles;
  };

  PacketContext make_context(std::span<const Ray> batch, Vec3* transmitted) const {
    // Nobody asks for chances where all is opaque.
    const Chances chances(is_see_through() ? batch : std::span<const Ray>{});
    PacketContext context{{}, tree_.get(), channel_, chances, {}, {}, transmitted};
    rtcInitIntersectContext(&context.base);
    return context;
  }

  /// Calls take(segment, whether it was ended, what is left of its light). Shapes: left [kPacket], or null.
  template <typename Take>
  void occlude(std::span<const Ray> segments, Vec3* left, const Take& take) const {
    PacketContext context = make_context(segments, left);
    alignas(64) int valid[kPacket];
    RTCRay16 packet;
    set_constants(packet);
    for (std::size_t first = 0; first < segments.size(); first += kPacket) {
      const int count = static_cast<int>(std::min<std::size_t>(kPacket, segments.size() - first));
      for (int k = 0; k < kPacket; ++k) {
        valid[k] = k < count ? -1 : 0;
        set_lane(packet, k, segments[first + std::min(k, count - 1)]);
      }
      if (left != nullptr) std::fill_n(left, kPacket, Vec3{1, 1, 1});
      rtcOccluded16(valid, tree_->scene(), &context.base, &packet);
      for (int k = 0; k < count; ++k) take(first + k, packet.tfar[k] < 0, left != nullptr ? left[k] : Vec3{});
    }
  }

  void query_sphere(Vec3 centre, double radius, RTCPointQueryFunction collect, void* user) const {
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query{};
    query.x = static_cast<float>(centre.x);
    query.y = static_cast<float>(centre.y);
    query.z = static_cast<float>(centre.z);
    query.radius = static_cast<float>(radius + kRounding * (1 + radius + length(centre)));
    rtcPointQuery(tree_->scene(), &query, &context, collect, user);
  }

  std::shared_ptr<const Tree> tree_;
  int channel_;
  std::array<std::unique_ptr<EmbreeVisibility>, 2> others_;  ///< channels 1 and 2, where they may differ
};

}  // namespace

std::unique_ptr<Visibility> make_embree_visibility(std::span<const Corners> triangles, std::stop_token stop,
                                                   const Opacity* opacity) {
  auto tree = std::make_shared<const Tree>(triangles, stop, opacity);
  if (!tree->is_built()) return nullptr;
  return std::make_unique<EmbreeVisibility>(std::move(tree), 0);
}

}  // namespace radbake::radiosity
