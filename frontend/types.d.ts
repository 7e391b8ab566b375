/** Values that travel between the server and the page, named as in the server's formats. Units are in the names. */
declare interface Raster { metres_per_pixel: number; width_px: number; height_px: number; }
declare interface RodLayout { id: string; x_m: number; y_m: number; outer_radius_m: number; inner_radius_m: number; }
declare interface Camera { width_px: number; height_px: number; metres_per_pixel: number; }
declare interface Pond { width_m: number; height_m: number; rods?: RodLayout[]; }
declare interface Counts { snapshots: number; placed: number; uncertain: number; rejected: number; [name: string]: number; }
declare interface SessionFacts {
  id: string; name: string; state: string; revision: number; created_at?: string; camera?: Camera; pond?: Pond;
  rods?: number; rods_seen?: number; counts?: Partial<Counts>; coverage?: number | null; quality?: { sentence?: string; [name: string]: unknown } | null;
  baseline?: string | null; pose_noise?: { sigma_xy_m: number; sigma_theta_rad: number } | null;
}
declare interface PoseRow {
  robot: string; sequence: number; boot?: number; x_m: number | null; y_m: number | null; theta_rad: number | null;
  sigma_xy_m: number | null; sigma_theta_rad: number | null; status: 'placed' | 'uncertain' | 'rejected';
  received_at?: string; captured_at?: string; raw_x_m?: number; raw_y_m?: number; raw_theta_rad?: number;
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
declare interface RodFacts extends RodRow { method?: string; model_digest?: string | null; snapshots: Evidence[]; }
declare interface PatchHeader {
  type: 'patch'; layer: string; x: number; y: number; width: number; height: number; revision: number; mime: string;
}
declare interface Patch extends PatchHeader { content: Uint8Array<ArrayBuffer>; }
/** `declare var`, because the map library is a classic script. */
declare var ol: typeof import('ol/dist/ol.js').default;
