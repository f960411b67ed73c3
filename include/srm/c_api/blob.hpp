// A blob: the resolved parameters of one drive.
//
//   offset  bytes
//        0      8  "SRMDRIVE"
//        8      4  version of the format, little-endian
//       12      4  number of phases
//       16     24  law, padded with zeros: EdgeMpc
//       40     16  machine model: LeHuy, FluxMap
//       56      8  precision of the controller: float, double
//       64      8  around the law: frame, states, or diagnose (control_part.hpp)
//       72      8  layout: hash of the names of all fields (archive.hpp)
//       80      8  checksum: FNV-1a over all other bytes
//       88         parameters, doubles (archive.hpp)
#pragma once

#include <cstring>
#include <string>
#include <string_view>

#include "srm/c_api/archive.hpp"
#include "srm/c_api/reluctance.h"

namespace srm::c_api {

inline constexpr std::uint32_t blob_version = 2;
inline constexpr std::size_t blob_header = 88;

struct Blob {
  int n_phases = 0;
  std::string law, machine, precision, around;
  std::uint64_t layout = 0, checksum = 0;
  const unsigned char* parameters = nullptr;
  std::size_t size = 0;  // of the parameters [B]
};

/// What stands around the law of a controller with parameters P.
template <class P>
constexpr std::string_view around() {
  if constexpr (requires(P p) { p.drive.control.diagnosis; }) {
    return "diagnose";
  } else if constexpr (requires(P p) { p.supervision; }) {
    return "states";
  } else {
    return "frame";
  }
}

/// Numbers of the blob are little-endian, as every target of this library is.
template <class V>
V number_at(const unsigned char* bytes, std::size_t offset) {
  V value;
  std::memcpy(&value, bytes + offset, sizeof value);
  return value;
}

inline std::string text_at(const unsigned char* bytes, std::size_t offset, std::size_t length) {
  const char* from = reinterpret_cast<const char*>(bytes) + offset;
  std::size_t n = 0;
  while (n < length && from[n] != '\0') ++n;
  return {from, n};
}

inline srm_status parse(const unsigned char* bytes, std::size_t size, Blob& blob) {
  if (size < 12 || std::memcmp(bytes, "SRMDRIVE", 8) != 0) return SRM_NOT_A_BLOB;
  if (number_at<std::uint32_t>(bytes, 8) != blob_version) return SRM_WRONG_VERSION;
  if (size < blob_header || size % 8 != 0) return SRM_NOT_A_BLOB;
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  blob.checksum = hashed(hashed(hash_start, all.substr(0, 80)), all.substr(blob_header));
  if (number_at<std::uint64_t>(bytes, 80) != blob.checksum) return SRM_WRONG_CHECKSUM;
  blob.n_phases = number_at<std::int32_t>(bytes, 12);
  blob.law = text_at(bytes, 16, 24);
  blob.machine = text_at(bytes, 40, 16);
  blob.precision = text_at(bytes, 56, 8);
  blob.around = text_at(bytes, 64, 8);
  blob.layout = number_at<std::uint64_t>(bytes, 72);
  blob.parameters = bytes + blob_header;
  blob.size = size - blob_header;
  return SRM_OK;
}

/// The bytes of a blob of this kind with these parameters.
inline std::string written(const Blob& of, const Writer& parameters) {
  std::string bytes = "SRMDRIVE";
  const auto add = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto text = [&](const std::string& value, std::size_t length) {
    bytes.append(value).append(length - value.size(), '\0');
  };
  add(blob_version);
  add(std::int32_t(of.n_phases));
  text(of.law, 24);
  text(of.machine, 16);
  text(of.precision, 8);
  text(of.around, 8);
  add(parameters.layout.hash);
  const std::size_t head = bytes.size();
  for (const double number : parameters.list) add(number);
  const std::uint64_t checksum = hashed(hash_start, bytes);
  bytes.insert(head, reinterpret_cast<const char*>(&checksum), sizeof checksum);
  return bytes;
}

}  // namespace srm::c_api
