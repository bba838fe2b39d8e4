#pragma once

#include <cstdint>

namespace radbake {

/// Every limit that an error may name, with its default. Field for field radbake.v1.Limits.
struct Limits {
  std::uint64_t chunk_bytes = 128 << 10;      ///< data in an upload chunk
  std::uint64_t max_message_bytes = 1 << 20;  ///< that the server receives
  std::uint64_t max_digests_per_call = 1000;  ///< in FindMissing
  std::uint64_t max_blob_bytes = 1 << 30;     ///< a mesh, a texture, a layer
  std::uint64_t max_manifest_bytes = 1 << 20;
  std::uint64_t max_meshes = 8192;
  std::uint64_t max_textures = 1024;
  std::uint64_t max_lights = 1024;
  std::uint64_t max_vertices = 20'000'000;                        ///< of a scene
  std::uint64_t max_triangles = 10'000'000;                       ///< of a scene
  std::uint64_t max_texture_pixels = std::uint64_t{4096} * 4096;  ///< of a texture
  std::uint64_t max_atlas_size = 4096;
  std::uint64_t min_atlas_size = 64;
  std::uint64_t max_rays = 65536;  ///< of a texel
  std::uint64_t max_patches = 1'000'000;
  std::uint64_t max_queued_bakes = 1000;
  std::uint64_t max_running_bakes = 1;
  std::uint64_t max_content_bytes = 0;               ///< of a tenant's blobs, uploads included; 0: as the disk has
  std::uint64_t max_running_plans = 4;               ///< plans do not wait
  std::uint64_t min_free_disk_bytes = 256ULL << 20;  ///< below it nothing new is taken
  std::uint64_t max_connections = 256;               ///< one above is closed at once
  std::uint64_t max_calls_per_connection = 200;
  std::uint64_t max_uploads = 64;  ///< at the same time; each holds one message of memory
  std::uint64_t max_uploads_per_tenant = 32;
  std::uint64_t max_downloads = 64;  ///< at the same time; each holds one chunk of memory
  std::uint64_t max_downloads_per_tenant = 32;
  std::uint64_t max_watches = 1000;  ///< at the same time
  std::uint64_t max_watches_per_tenant = 500;
};

/// Copies limits into a message with the same fields: limits_message<v1::Limits>(limits). A template, so that this
/// folder knows no messages.
template <typename Message>
Message limits_message(const Limits& limits) {
  Message message;
  message.set_chunk_bytes(limits.chunk_bytes);
  message.set_max_message_bytes(limits.max_message_bytes);
  message.set_max_digests_per_call(limits.max_digests_per_call);
  message.set_max_blob_bytes(limits.max_blob_bytes);
  message.set_max_manifest_bytes(limits.max_manifest_bytes);
  message.set_max_meshes(limits.max_meshes);
  message.set_max_textures(limits.max_textures);
  message.set_max_lights(limits.max_lights);
  message.set_max_vertices(limits.max_vertices);
  message.set_max_triangles(limits.max_triangles);
  message.set_max_texture_pixels(limits.max_texture_pixels);
  message.set_max_atlas_size(limits.max_atlas_size);
  message.set_min_atlas_size(limits.min_atlas_size);
  message.set_max_rays(limits.max_rays);
  message.set_max_patches(limits.max_patches);
  message.set_max_queued_bakes(limits.max_queued_bakes);
  message.set_max_running_bakes(limits.max_running_bakes);
  message.set_max_content_bytes(limits.max_content_bytes);
  message.set_max_running_plans(limits.max_running_plans);
  message.set_min_free_disk_bytes(limits.min_free_disk_bytes);
  message.set_max_connections(limits.max_connections);
  message.set_max_calls_per_connection(limits.max_calls_per_connection);
  message.set_max_uploads(limits.max_uploads);
  message.set_max_uploads_per_tenant(limits.max_uploads_per_tenant);
  message.set_max_downloads(limits.max_downloads);
  message.set_max_downloads_per_tenant(limits.max_downloads_per_tenant);
  message.set_max_watches(limits.max_watches);
  message.set_max_watches_per_tenant(limits.max_watches_per_tenant);
  return message;
}

}  // namespace radbake
