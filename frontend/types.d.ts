/** Values that travel between the server and the page, named as in the server's formats. Units are in the names. */
declare interface Raster { metres_per_pixel: number; width_px: number; height_px: number; }
declare interface RodPlace { x_m: number; y_m: number; outer_radius_m: number; }
declare interface RodLayout extends RodPlace { id: string; inner_radius_m: number; }
declare interface Camera { width_px: number; height_px: number; metres_per_pixel: number; }
declare interface Pond { width_m: number; height_m: number; rods?: RodLayout[]; id?: string | null; layout_version?: number | null; }
declare interface Counts { snapshots: number; placed: number; uncertain: number; rejected: number; [name: string]: number; }
declare interface SessionFacts {
  id: string; name: string; state: string; revision: number; created_at?: string; camera?: Camera; pond?: Pond;
  rods?: number; rods_seen?: number; counts?: Partial<Counts>; coverage?: number | null; quality?: { sentence?: string; [name: string]: unknown } | null;
  raster?: Raster; method?: string; finished_at?: string | null; corrections?: MethodResult[];
  baseline?: string | null; pose_noise?: { sigma_xy_m: number; sigma_theta_rad: number } | null;
}
declare interface PoseRow {
  robot: string; sequence: number; boot?: number; x_m: number | null; y_m: number | null; theta_rad: number | null;
  sigma_xy_m: number | null; sigma_theta_rad: number | null; status: 'placed' | 'uncertain' | 'rejected';
  received_at?: string; captured_at?: string; raw_x_m?: number; raw_y_m?: number; raw_theta_rad?: number;
  battery?: number; link_loss?: number; image_quality?: number;
}
declare interface RodRow {
  rod_id: string; state: 'empty' | 'partial' | 'full' | 'unseen'; fill: number | null; confidence: number; views: number;
  conflicting?: boolean; by_hand?: Judgement | null;
}
declare interface MachineReading { state: string; fill: number | null; confidence: number; }
declare interface Judgement {
  state: 'empty' | 'partial' | 'full' | null; fill: number | null; reason: string; by: string; at: string; machine: MachineReading;
}
declare interface PastReading { at: string; revision: number; state: RodRow['state']; fill: number | null; confidence: number; views: number; conflicting: boolean; }
declare interface Note {
  id: number; text: string; by: string; at: string; rod_id: string | null; x_m: number | null; y_m: number | null;
  moment: string | null; closed_at: string | null; closed_by: string | null;
}
declare interface RodStory { history: PastReading[]; by_hand: Judgement[]; notes: Note[]; }
declare interface PlanePose { x_m: number; y_m: number; theta_rad: number; }
declare interface Evidence {
  robot: string; boot: number; sequence: number; captured_at: string; raw: PlanePose; corrected: PlanePose | null;
  status: string; fill?: number | null;
}
declare interface RodFacts extends RodRow { method?: string; method_digest?: string; model_digest?: string | null; snapshots: Evidence[]; place?: RodPlace; camera?: Camera; }
declare interface PatchHeader {
  type: 'patch'; layer: string; x: number; y: number; width: number; height: number; revision: number; mime: string;
}
declare interface Patch extends PatchHeader { content: Uint8Array<ArrayBuffer>; }
/** `declare var`, because the map library is a classic script. */
declare var ol: typeof import('ol/dist/ol.js').default;
/** Of `GET /api/compare`. */
declare interface SideReading { state: RodRow['state']; fill: number | null; confidence: number; views: number; conflicting: boolean; }
declare interface RodChange {
  rod_id: string; change: string; word: string | null; reason: string | null; confidence: number; p_changed: number;
  residual_px: number | null; residual_mm: number | null; counterpart: string | null; x_m: number; y_m: number;
  base: SideReading; with: SideReading;
}
declare interface CompareSide {
  session: string; name: string; pond_id: string | null; state: string; method: string; revision: number;
  created_at: string | null; finished_at: string | null; coverage: number | null; rods: number; rods_seen: number;
}
declare interface Residual {
  rods: number; limit_px: number; limit_mm: number; shift_mm: [number, number] | null;
  median_px: number | null; p95_px: number | null; max_px: number | null; median_mm: number | null; p95_mm: number | null; max_mm: number | null;
}
declare interface CompareAnswer {
  base: CompareSide; with: CompareSide; comparable: boolean; reason: string | null; sentence: string; residual: Residual;
  rods: RodChange[]; not_comparable: RodChange[]; counts: Record<string, number>; compared: number; not_observed: number;
  only_in_base: string[]; only_in_with: string[];
}
/** Of `/api/ponds`. */
declare interface PondSummary { id: string; name: string; rods: number; layout_version: number; created_at: string; inspections?: number; last?: string | null; }
declare interface LayoutVersion { version: number; source: string; rods: number; digest: string; created_at: string; }
declare interface PondInspection {
  id: string; name: string; state: string; method: string; revision: number; layout_version: number | null; coverage: number | null;
  created_at: string | null; finished_at: string | null;
}
declare interface Inventory { id: string; pond_id: string; name: string; digest: string; layout_version: number; lines: number; created_at: string; }
declare interface PondFacts {
  id: string; name: string; rods: number; layout_version: number; created_at: string; layout: Pond;
  versions: LayoutVersion[]; inspections: PondInspection[]; inventories: Inventory[];
}
declare interface Trend {
  session: string; name: string; session_state: string; at: string; coverage: number | null; rods: number;
  counts: { empty: number; partial: number; full: number; not_observed: number }; conflicting: number; mean_fill: number | null;
}
declare interface PastInspection {
  session: string; name: string; session_state: string; method: string; at: string; layout_version: number | null; state: RodRow['state'] | null;
  fill: number | null; confidence: number | null; views: number; conflicting: boolean; reason: string | null;
}
/** Of `/api/sessions/{id}/corrections`. */
declare interface MethodResult {
  method: string; state: string; revision: number; error: string | null; quality: { sentence: string }; created_at: string | null; finished_at: string | null;
}
/** Of `/api/sessions/{id}/reconcile`. */
declare interface ReconciledLine {
  line: number; item: string; position: string; declared: string; date: string; outcome: string; confidence: number | null; observed: SideReading | null;
}
declare interface Reconciliation {
  session: string; name: string; revision: number; method: string; same_pond: boolean; inventory: Inventory; counts: Record<string, number>; total: number;
  lines: ReconciledLine[]; undeclared: { position: string; observed: SideReading }[];
}
/** Of `/api/sessions/{id}/corrections/verdicts`. */
declare interface MethodSide { method: string; revision: number; counts: Record<string, number>; }
declare interface Verdicts {
  session: string; base: MethodSide; with: MethodSide; same: number; rods: { rod_id: string; base: SideReading; with: SideReading; p_differ: number | null }[];
}
