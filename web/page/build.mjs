// node build.mjs OUT_DIR: bundles the page into OUT_DIR.
import { copyFile, mkdir } from 'node:fs/promises';
import { build } from 'esbuild';

const out = process.argv[2];
if (!out) throw new Error('usage: node build.mjs OUT_DIR');
await mkdir(out, { recursive: true });
await build({
  entryPoints: { page: 'src/main.ts' },
  outdir: out,
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'none',
  logLevel: 'warning',
});
await copyFile('src/page.css', `${out}/page.css`);
await copyFile('src/index.html', `${out}/index.html`);
