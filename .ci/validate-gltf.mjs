// Exports every sample that the Khronos validator accepts, and asserts that it accepts the exports too.
//
//   node .ci/validate-gltf.mjs ORTHANT SOAK ASSETS
//
// ORTHANT is the program, SOAK its example `soak`, ASSETS a folder of .gltf and .glb files; NODE_PATH or the current
// folder has gltf-validator. Every file is converted to .gltf, to .glb, and to .glb with its images embedded; up to
// EDITED of them, spread over the folder, are exported once more after random edits. A sample that the program refuses
// is counted, not judged: import has tests of its own. Ends with 1 if an export has an error that its source has not, or
// if the random edits find a fault of their own.

import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { dirname, join, relative, resolve } from 'node:path';

const EDITED = 48;
const EDITS = 80;
const LARGEST_EDITED = 4 << 20;

const [program, soak, assets] = process.argv.slice(2).map((path) => resolve(path));
if (!program || !soak || !assets || !existsSync(assets)) {
  console.error('usage: node validate-gltf.mjs ORTHANT SOAK ASSETS');
  process.exit(2);
}
const validator = createRequire(join(process.cwd(), 'x.js'))('gltf-validator');

function* models(folder) {
  const entries = readdirSync(folder, { withFileTypes: true });
  for (const entry of entries.sort((a, b) => (a.name < b.name ? -1 : 1))) {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) yield* models(path);
    else if (/\.(gltf|glb)$/i.test(entry.name)) yield path;
  }
}

// The errors of a file, by code and place.
async function errors(path) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(path)), {
    uri: path,
    maxIssues: 0,
    writeTimestamp: false,
    externalResourceFunction: async (uri) =>
      new Uint8Array(readFileSync(join(dirname(path), decodeURIComponent(uri)))),
  });
  return report.issues.messages.filter((m) => m.severity === 0).map((m) => `${m.code} ${m.pointer ?? ''} ${m.message}`);
}

const targets = [
  ['out.gltf', []],
  ['out.glb', []],
  ['embedded.glb', ['--images', 'embed']],
];
const counts = { samples: 0, rejected: 0, refused: 0, exports: 0, edited: 0 };
const accepted = [];
const failures = [];
for (const path of models(assets)) {
  counts.samples++;
  const name = relative(assets, path);
  let before;
  try {
    before = await errors(path);
  } catch (error) {
    // Its message may have paths of this machine.
    before = ['the validator cannot read it'];
  }
  if (before.length > 0) {
    counts.rejected++;
    continue;
  }
  const folder = mkdtempSync(join(tmpdir(), 'orthant-'));
  try {
    for (const [file, options] of targets) {
      const out = join(folder, file);
      try {
        execFileSync(program, ['convert', path, out, '--quiet', ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
      } catch (error) {
        if (error.status !== 3) failures.push(`${name}: exit code ${error.status}: ${String(error.stderr).replaceAll(`${assets}/`, '')}`);
        else {
          console.log(`refused: ${String(error.stderr).trim().replaceAll(`${assets}/`, '')}`);
          counts.refused++;
        }
        break;
      }
      counts.exports++;
      if (file === 'out.glb') accepted.push(path);
      for (const message of await errors(out)) failures.push(`${name} -> ${file}: ${message}`);
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
}

// After random edits, each compared with a full derivation. Large files would take their time and show nothing more.
const small = accepted.filter((path) => statSync(path).size <= LARGEST_EDITED);
const step = Math.max(1, Math.ceil(small.length / EDITED));
for (const [seed, path] of small.filter((_, i) => i % step === 0).entries()) {
  const name = relative(assets, path);
  const folder = mkdtempSync(join(tmpdir(), 'orthant-'));
  try {
    const options = ['--scene', path, '--edits', EDITS, '--every', EDITS / 4, '--seed', seed, '--export', folder];
    execFileSync(soak, [...options.map(String), '--findings', folder], { stdio: ['ignore', 'pipe', 'pipe'] });
    for (const file of readdirSync(folder)) {
      counts.edited++;
      for (const message of await errors(join(folder, file))) failures.push(`${name}, edited by seed ${seed}: ${message}`);
    }
  } catch (error) {
    failures.push(`${name}, edited by seed ${seed}: exit code ${error.status}: ${String(error.stderr).replaceAll(`${assets}/`, '')}`);
  } finally {
    rmSync(folder, { recursive: true });
  }
}
console.log(
  `${counts.samples} samples, ${counts.rejected} that the validator rejects, ${counts.refused} that import refuses, ` +
    `${counts.exports} exports, ${counts.edited} exports after ${EDITS} random edits, ${failures.length} errors`,
);
for (const failure of failures) console.error(failure);
process.exit(failures.length > 0 || counts.exports === 0 || counts.edited === 0 ? 1 : 0);
