#pragma once

#include <embree3/rtcore.h>

#include <ctime>
#include <functional>
#include <span>
#include <vector>

#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// CPU seconds of the process: all is on one thread, and other programs do not count.
inline double seconds_of(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Passes all questions on and remembers the rays.
class Recorder final : public Visibility {
 public:
  explicit Recorder(const Visibility& inner) : inner_(inner) {}
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override {
    nearest.insert(nearest.end(), rays.begin(), rays.end());
    inner_.trace(rays, hits);
  }
  void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const override {
    shadow.insert(shadow.end(), segments.begin(), segments.end());
    inner_.blocked(segments, blocked);
  }
  void transmitted(std::span<const Ray> segments, std::span<Vec3> shares) const override {
    shadow.insert(shadow.end(), segments.begin(), segments.end());
    inner_.transmitted(segments, shares);
  }
  bool is_see_through() const override { return inner_.is_see_through(); }
  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    inner_.triangles_near(point, distance, triangles);
  }
  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    inner_.triangles_in(shaft, triangles);
  }
  std::string instruction_set() const override { return inner_.instruction_set(); }

  mutable std::vector<Ray> nearest, shadow;

 private:
  const Visibility& inner_;
};

/// Embree alone, on a tree of the same triangles: its packets ready in memory, nothing done with what it finds.
class Embree {
 public:
  explicit Embree(std::span<const Corners> triangles) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * triangles.size()));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
    for (std::size_t at = 0; at < 3 * triangles.size(); ++at) {
      for (int axis = 0; axis < 3; ++axis)
        vertices[3 * at + axis] = static_cast<float>(triangles[at / 3][at % 3][axis]);
      indices[at] = static_cast<unsigned>(at);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~Embree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  double nearest_seconds(const std::vector<Ray>& rays) const {
    std::vector<RTCRayHit16> packets(rays.size() / kPacket);
    for (std::size_t k = 0; k < packets.size() * kPacket; ++k) {
      set(packets[k / kPacket].ray, k % kPacket, rays[k]);
      packets[k / kPacket].hit.geomID[k % kPacket] = RTC_INVALID_GEOMETRY_ID;
      packets[k / kPacket].hit.instID[0][k % kPacket] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    return seconds_of([&] {
      for (RTCRayHit16& packet : packets) rtcIntersect16(kAll, scene_, &context, &packet);
    });
  }
  double shadow_seconds(const std::vector<Ray>& rays) const {
    std::vector<RTCRay16> packets(rays.size() / kPacket);
    for (std::size_t k = 0; k < packets.size() * kPacket; ++k) set(packets[k / kPacket], k % kPacket, rays[k]);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    return seconds_of([&] {
      for (RTCRay16& packet : packets) rtcOccluded16(kAll, scene_, &context, &packet);
    });
  }

 private:
  static constexpr std::size_t kPacket = 16;

  static void set(RTCRay16& packet, std::size_t k, const Ray& ray) {
    packet.org_x[k] = ray.origin[0], packet.org_y[k] = ray.origin[1], packet.org_z[k] = ray.origin[2];
    packet.dir_x[k] = ray.direction[0], packet.dir_y[k] = ray.direction[1], packet.dir_z[k] = ray.direction[2];
    packet.tnear[k] = 0, packet.tfar[k] = ray.max_distance, packet.time[k] = 0;
    packet.mask[k] = 0xffffffffu, packet.id[k] = 0, packet.flags[k] = 0;
  }
  alignas(64) static constexpr int kAll[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace radbake::radiosity
