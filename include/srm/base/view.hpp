// Numbers that live elsewhere: constants in flash on the target, memory of the caller on the desk.
#pragma once

namespace srm {

template <class V>
struct View {
  using Value = V;

  const V* data = nullptr;
  int size = 0;

  constexpr V operator[](int j) const { return data[j]; }
  constexpr const V* begin() const { return data; }
  constexpr const V* end() const { return data + size; }
};

}  // namespace srm
