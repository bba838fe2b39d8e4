// Validates glTF files with the Khronos validator, prints what it finds and exits with 1 if there is an error.
//
//   node validate.js FILE ...     in the folder that holds node_modules
//
// Information ("this extension is not known to me") is left out: MOZ_lightmap is no extension of Khronos.
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';

const validator = createRequire(path.join(process.cwd(), 'here.js'))('gltf-validator');
const kinds = ['error', 'warning', 'information', 'hint']; // the validator's numbers of severity
const shown = 2;

let errors = 0;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: path.basename(file),
    maxIssues: 0, // all of them
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(path.join(path.dirname(file), decodeURIComponent(uri)))),
  });
  const { numErrors, numWarnings, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const { code, message, pointer, severity } of messages) {
    if (severity < shown) console.log(`  ${kinds[severity]} ${code} at ${pointer ?? 'the file'}: ${message}`);
  }
  errors += numErrors;
}
process.exitCode = errors > 0 ? 1 : 0;
