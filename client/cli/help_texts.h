#pragma once

namespace radbake::cli {

// What stands below the options in each command's help.

inline constexpr char kServerHelp[] = "HOST:PORT or unix:PATH of a radbaked (environment: RADBAKE_SERVER)";
inline constexpr char kCaHelp[] =
    "Speak TLS: PEM file of the authorities that signed the server's certificate (environment: RADBAKE_TLS_CA)";
inline constexpr char kCertificateHelp[] =
    "This client's certificate, for a server that asks for one (environment: RADBAKE_TLS_CERT)";
inline constexpr char kKeyHelp[] = "Its private key (environment: RADBAKE_TLS_KEY)";
inline constexpr char kTokenHelp[] =
    "File whose first line is this client's token, for a server that asks for one (environment: RADBAKE_TOKEN, the "
    "token itself)";
inline constexpr char kExitCodes[] =
    "Exit codes: 0 done, 2 usage, 3 bad scene, 4 server unreachable, unwilling or without room, 5 bake failed, "
    "6 cancelled, 7 error asked for not reached (--strict), 130 left by Ctrl-C.\n";

inline constexpr char kMainFooter[] =
    "\nExamples:\n"
    "  radbake submit room.glb -o baked/                 bake here, with a private server\n"
    "  radbake submit room.glb -o baked/ --server bakery:7419\n"
    "  radbake plan room.glb                             what would be simulated, why, and what it takes\n"
    "  radbake submit --help                             what can be chosen, with more examples\n"
    "  export RADBAKE_SERVER=bakery:7419; radbake list   what the server bakes and has baked\n"
    "  radbake list --server bakery:7419 --tls-ca ca.pem --token-file ~/.radbake-token\n\n";

inline constexpr char kSubmitFooter[] =
    "\nWrites to DIR, when all is done:\n"
    "  scene.glb        the scene with its light: nothing lost, final TEXCOORD_1, the lightmap as MOZ_lightmap,\n"
    "                   light by vertex as _IRRADIANCE\n"
    "  lightmap_N.exr   irradiance in lx, linear Rec.709, float32; alpha is coverage; see --encoding\n"
    "  lightmap_N_direct.exr, lightmap_N_indirect.exr, lightmap_N_ao.exr   where --layers asks for them\n"
    "  error_N.exr      standard error of each of its texels, lx\n"
    "  lightmap_N.png   an exposed preview, for the eye only\n"
    "  lightmaps.json   which primitive of which node lies where in which lightmap\n"
    "  report.json      what was planned, what was done, how well, and how long it took beside what was predicted\n"
    "The first line on stdout is the job's name. Ctrl-C ends the job with the best so far, which is written; a second\n"
    "Ctrl-C cancels it, a third does not wait for that.\n"
    "\nExamples:\n"
    "  radbake submit room.glb -o baked/\n"
    "      the lightmap is the smallest that gives 32 texels a metre; meshes without a usable TEXCOORD_1 are "
    "unwrapped\n"
    "  radbake submit level.glb -o baked/ --atlas-size 1024 --texels-per-meter 16 --encoding exr,png-rgbm\n"
    "      sheets of 1024 texels, as many as it takes; for an engine that reads RGBM too\n"
    "  radbake submit town.glb -o baked/ --output vertices --vertex-colors\n"
    "      no lightmap: light at each vertex, and as COLOR_0 for viewers that know nothing else\n"
    "  radbake submit room.glb -o baked/ --max-error 2%\n"
    "      refined until the lightmaps are within 2 %, which report.json and the last line say with an interval\n"
    "  radbake submit room.glb -o baked/ --time-budget 30s\n"
    "      the best of half a minute; with --max-error too, whichever comes first\n"
    "  radbake submit room.glb -o baked/ --quality production --time-budget 10m --strict || echo \"not good enough\"\n"
    "      exit code 7 where the time was up before the error was reached\n"
    "  radbake submit room.glb -o baked/ --force --quality draft\n"
    "      a quick preview over the results of an earlier bake\n"
    "  radbake submit house.glb -o baked/ --sky 3000,3500,5000 --sun 0.4,-1,0.3:80000,76000,70000\n"
    "      daylight: a blue sky, and a sun that stands high\n"
    "  radbake submit house.glb -o baked/ --hdri dawn.exr:2500 --layers direct,indirect,ao\n"
    "      light from a sky image whose 1 is 2500 nit; direct and indirect light and openness as maps of their own\n"
    "  radbake submit room.glb -o baked/ --effect interreflection=off --effect alpha_mask=off\n"
    "      direct light only, and leaves of a tree as full squares: what an effect is worth\n"
    "  radbake submit level.glb --server bakery:7419 --detach --max-error 1%\n"
    "      overnight: prints the bake's name and leaves; radbake list and radbake download find it in the morning\n"
    "  radbake submit room.glb --dry-run\n"
    "      checks all, prints the plan, bakes nothing\n"
    "  radbake submit lab.glb -o baked/ --form-factors analytic --max-patches 500 --solver lu\n"
    "      a reference: form factors by formula, elimination; for small scenes\n"
    "  radbake submit city.glb -o baked/ --max-patches 200000 --memory 512M\n"
    "      form factors that do not fit are streamed: made again, row by row, each time they are used\n"
    "  radbake submit room.glb -o baked/ --json | jq -r 'select(.event == \"progress\") | .progress.fraction'\n"
    "      one event a line, for programs\n\n";

inline constexpr char kPlanFooter[] =
    "\nTakes all options of submit that decide a bake, and prints one page: facts of the scene; every effect as\n"
    "  on           simulated\n"
    "  off          there, and provably without effect here: --effect NAME=on simulates it all the same\n"
    "  unsupported  in the scene, and not simulated\n"
    "  absent       neither in the scene nor asked for\n"
    "each with the reason; methods with theirs; predicted CPU time, wall time and memory; the costliest meshes.\n"
    "[3 s] behind an effect is CPU time that it takes, or saves where it is off.\n"
    "\nExamples:\n"
    "  radbake plan room.glb\n"
    "  radbake plan room.glb --sun 0.4,-1,0.3:80000,76000,70000 --rays 1024\n"
    "  radbake plan room.glb --max-error 2%\n"
    "  radbake plan room.glb --effect interreflection=off\n"
    "      what is left without it, and what it would take\n"
    "  radbake plan room.glb --json | jq -r '.effects[] | select(.state == \"on\") | .effect'\n"
    "  radbake plan room.glb --json | jq .prediction.total.cpu_seconds\n\n";

inline constexpr char kListFooter[] =
    "\nOf bakes that wait: their place in the queue and when they may start; \"shares NAME\" where an equal bake\n"
    "runs for them, too.\n"
    "\nExamples:\n"
    "  radbake list --server bakery:7419\n"
    "  radbake list --json | jq -r '.bakes[] | select(.state == \"FAILED\") | .name'\n\n";

inline constexpr char kWatchFooter[] =
    "\nCtrl-C leaves; the bake goes on.\n"
    "\nExamples:\n"
    "  radbake watch bakes/3f9c --server bakery:7419\n"
    "  radbake watch bakes/3f9c && radbake download bakes/3f9c -o baked/\n\n";

inline constexpr char kFinishFooter[] =
    "\nThe bake ends at the end of its first pass, or at once in a later one, and has succeeded then. Returns at "
    "once;\n"
    "a bake that has ended stays as it is.\n"
    "\nExamples:\n"
    "  radbake finish bakes/3f9c --server bakery:7419\n"
    "  radbake finish bakes/3f9c && radbake watch bakes/3f9c && radbake download bakes/3f9c -o baked/\n\n";

inline constexpr char kCancelFooter[] =
    "\nAsks the bake to stop and returns at once; a bake that has ended stays as it is.\n"
    "\nExamples:\n"
    "  radbake cancel bakes/3f9c --server bakery:7419\n\n";

inline constexpr char kDownloadFooter[] =
    "\nWrites what submit would have written; scene.glb and lightmaps.json need the scene that was baked: --scene.\n"
    "Results wait on the server for who asks.\n"
    "\nExamples:\n"
    "  radbake download bakes/3f9c -o baked/ --scene room.glb --server bakery:7419\n"
    "  radbake download bakes/3f9c -o baked/ --server bakery:7419\n"
    "  radbake download bakes/3f9c -o baked/ --force     over the results of an earlier bake\n\n";

inline constexpr char kCapabilitiesFooter[] =
    "\nExamples:\n"
    "  radbake capabilities                              of a private server\n"
    "  radbake capabilities --server bakery:7419 --json | jq .limits.max_triangles\n\n";

inline constexpr char kCompareFooter[] =
    "\nPrints, over texels inside charts that are no emitters:\n"
    "  rrmse      root mean square difference over texels and channels / mean of the reference\n"
    "  per_texel  root mean square of each texel's relative difference of luminance; p95: its 95th percentile\n"
    "  bias       mean difference / mean of the reference\n"
    "and percentiles of that relative difference with the place of the largest. With --error: the share of values\n"
    "within 1.96 standard errors (95 % where they hold) and the standardised error (1 where they hold).\n"
    "\nExamples:\n"
    "  radbake compare reference/lightmap_0.exr baked/lightmap_0.exr -o difference.png\n"
    "  radbake compare reference/lightmap_0.exr baked/lightmap_0.exr --error baked/error_0.exr\n"
    "  radbake compare tests/golden/cornell_ref.exr baked/lightmap_0.exr --scale 0.31830988618 --json | jq .rrmse\n\n";

}  // namespace radbake::cli
