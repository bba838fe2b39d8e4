#pragma once

#include "common/scene/scene.h"

namespace radbake::tests {

/// Form factor from a point of the unit cube's walls to its floor: `along` the wall and `height` above the floor, 0..1.
///
///   F = f(along) + f(1 - along),  f(b) = 1/(2 pi)[ atan(1/Y) - Y/s atan(1/s) ],  X = 1/b, Y = height/b, s^2 = X^2 +
///   Y^2
///
/// Source: Howell's catalogue, element to a perpendicular rectangle.
double wall_to_floor(double along, double height);

/// The same from a point of the ceiling, x and z within 0..1.
double ceiling_to_floor(double x, double z);

/// A unit cube whose radiosity is known everywhere: 1.5 lx on the floor (y = 0), 1 lx elsewhere.
///
///   E = 1.5 - rho on the floor,  E = 1 - rho (1 + F(dA -> floor)/2) elsewhere,  H = 1 and 1 + F/2
///
/// E reaches the scene as an emissive texture of `texture_size` texels a side, which holds it at its texels' centres.
/// Each face has a chart of RoomBuilder(3). Precondition: reflectance <= 0.6, so that E >= 0.
Scene manufactured_room(double reflectance, int texture_size);

/// A closed unit cube of one reflectance, lit by a square of 1/7 x 1/7 m amid its ceiling (y = 1) that sends 6 lm, so
/// that the mean of E over the cube is 1 lx. The ceiling is nine quads "ceiling", the one in the middle "lamp". A
/// bake's default patches are 14 x 14 a face, four of them the lamp.
Scene cube_with_lamp(double reflectance);
inline constexpr double kLampLow = 6.0 / 14, kLampHigh = 8.0 / 14, kLampExitance = 294;

}  // namespace radbake::tests
