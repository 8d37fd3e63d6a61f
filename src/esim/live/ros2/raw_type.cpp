#ifdef ESIM_ROS2

#include "esim/live/ros2/raw_type.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace esim::inline live {
namespace {

/// A message; its text is padded to a multiple of four bytes, as Cyclone DDS reads it.
struct RawData : ddsi_serdata {
  std::string bytes{};
  std::uint32_t size = 0;  // without padding
};

const RawData& raw(const ddsi_serdata* data) { return *static_cast<const RawData*>(data); }

RawData* make(const ddsi_sertype* type, ddsi_serdata_kind kind, std::string bytes) {
  auto* const data = new RawData;
  ddsi_serdata_init(data, type, kind);
  data->hash = type->serdata_basehash;
  data->size = static_cast<std::uint32_t>(bytes.size());
  bytes.resize((bytes.size() + 3) / 4 * 4);
  data->bytes = std::move(bytes);
  return data;
}

ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                             std::size_t size) {
  std::string bytes;
  bytes.reserve(size);
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= bytes.size() || fragment->min > bytes.size()) continue;  // fragments may overlap
    const unsigned char* const payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    const std::size_t known = bytes.size() - fragment->min;
    bytes.append(reinterpret_cast<const char*>(payload) + known, fragment->maxp1 - bytes.size());
  }
  return make(type, kind, std::move(bytes));
}

ddsi_serdata* from_vectors(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                           const ddsrt_iovec_t* vectors, std::size_t) {
  std::string bytes;
  for (ddsrt_msg_iovlen_t i = 0; i < count; ++i)
    bytes.append(static_cast<const char*>(vectors[i].iov_base), vectors[i].iov_len);
  return make(type, kind, std::move(bytes));
}

constexpr ddsi_serdata_ops kDataOps = [] {
  ddsi_serdata_ops ops{};
  ops.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };  // without keys, all are one instance
  ops.get_size = [](const ddsi_serdata* data) { return raw(data).size; };
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_vectors;
  ops.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
    return make(type, SDK_KEY, {});
  };
  ops.from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) -> ddsi_serdata* {
    return make(type, kind, kind == SDK_DATA ? *static_cast<const std::string*>(sample) : std::string());
  };
  ops.to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
    std::memcpy(to, raw(data).bytes.data() + offset, size);
  };
  ops.to_ser_ref = [](const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* to) {
    to->iov_base = const_cast<char*>(raw(data).bytes.data()) + offset;
    to->iov_len = size;
    return ddsi_serdata_ref(data);
  };
  ops.to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); };
  ops.to_sample = [](const ddsi_serdata* data, void* sample, void**, void*) {
    static_cast<std::string*>(sample)->assign(raw(data).bytes, 0, raw(data).size);
    return true;
  };
  ops.to_untyped = [](const ddsi_serdata* data) -> ddsi_serdata* {
    RawData* const untyped = make(data->type, SDK_KEY, {});
    untyped->type = nullptr;
    return untyped;
  };
  ops.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return true; };
  ops.free = [](ddsi_serdata* data) { delete static_cast<RawData*>(data); };
  ops.print = [](const ddsi_sertype*, const ddsi_serdata*, char* to, std::size_t) -> std::size_t {
    *to = '\0';
    return 0;
  };
  ops.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* to, bool) { std::memset(to, 0, sizeof *to); };
  return ops;
}();

const ddsi_sertype_ops kTypeOps = [] {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete type;
  };
  ops.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  ops.realloc_samples = [](void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) samples[i] = nullptr;  // samples are never lent
  };
  ops.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  ops.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // their names are compared before
  ops.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return ops;
}();

}  // namespace

dds_entity_t create_raw_topic(dds_entity_t participant, const char* name, const char* type_name) {
  auto* type = new ddsi_sertype{};
  ddsi_sertype_init(type, type_name, &kTypeOps, &kDataOps, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  const dds_entity_t topic = dds_create_topic_sertype(participant, name, &type, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(type);
  return topic;
}

}  // namespace esim::inline live

#endif
